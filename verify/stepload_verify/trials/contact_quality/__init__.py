"""How a contact is made: what it costs a result, and how soon a slip or a share is seen."""
