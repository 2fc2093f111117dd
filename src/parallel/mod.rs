//! Who owns what, and how data moves between ranks.
