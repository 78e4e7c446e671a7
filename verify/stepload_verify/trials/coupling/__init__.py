"""Arms that give way sideways, and what friction at the contact does to a result."""
