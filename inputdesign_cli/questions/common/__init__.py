"""Steps that several kinds of questions share once their objects are built."""
