//! Direct light of pass 2: shadow rays from shaded points to every emitter and light.
