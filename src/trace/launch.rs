//! Which tubes to send.
