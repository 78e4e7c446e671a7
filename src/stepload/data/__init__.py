"""Results for users: columns, typed objects, files of other programs, a catalogue."""
