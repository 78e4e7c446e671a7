"""What each code means that stepload prints or writes."""
