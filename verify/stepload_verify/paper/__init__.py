"""The paper's tables and figures, computed again and printed beside the printed ones."""
