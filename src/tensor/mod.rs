//! Small fixed-size tensors.
