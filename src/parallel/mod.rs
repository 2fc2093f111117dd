//! Who owns what, and how data moves between ranks.
//!
//! | file | idea |
//! |---|---|
//! | `world.rs` | the communicator with typed reductions; ranks fail together |
//! | `exchange.rs` | sparse exchange with unknown senders |
//! | `halo.rs` | fixed exchange between owners and copies |
//! | `bricks.rs` | units of partition on a lattice |
//! | `cells.rs` | units of partition on a mesh |
//! | `metis.rs` | the partitioner |
//! | `diffuse.rs` | an old partition levelled by few moves |
//! | `partition.rs` | owner of each unit, cell and node |
//! | `migrate.rs` | points to the ranks that own their cells |
//! | `nearest.rs` | the point nearest to a place |
//! | `number.rs` | numbers of points without gaps |
//! | `traffic.rs` | messages, bytes and reductions, counted |
//! | `launcher.rs` | whether the launcher belongs to this MPI |
//! | `signals.rs` | SIGTERM and SIGUSR1 as a wish of all ranks |

pub(crate) mod balance;
pub(crate) mod bricks;
pub(crate) mod cells;
pub(crate) mod diffuse;
pub mod exchange;
pub(crate) mod halo;
pub(crate) mod launcher;
pub(crate) mod metis;
pub mod migrate;
pub(crate) mod nearest;
pub(crate) mod number;
pub mod partition;
pub(crate) mod signals;
pub(crate) mod traffic;
pub(crate) mod world;

pub use exchange::exchange;
pub use halo::{HaloPlan, exchange_known};
pub use migrate::{distribute_seeded, migrate};
pub use partition::Partition;
pub use traffic::Traffic;
pub use world::World;
