//! Components and resources, and spawning a description into a world.
