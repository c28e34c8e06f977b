//! From patches to what the eye sees.
