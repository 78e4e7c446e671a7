"""Results as people hold them: columns, typed objects, files of other programs, a catalogue."""
