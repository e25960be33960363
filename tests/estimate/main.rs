//! The network and its shipped model: what it promises on rims that it has not seen.

#[path = "../promises/mod.rs"]
mod promises;

mod network;
mod shipped;
