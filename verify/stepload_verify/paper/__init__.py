"""The paper's tables and figures, computed again and compared with the printed ones."""
