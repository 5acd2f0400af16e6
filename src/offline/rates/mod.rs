//! The renderer's rates, and one that they are compared with: the least that any rate needs, which is worked out on the CPU, outside of
//! the frame's time, and given to [`crate::Rate::Given`].

pub mod oracle;

use crate::Config;
use crate::offline::error::Result;
use crate::offline::headless::Options;
use crate::offline::session::Session;
use crate::offline::world::World;

/// What comes before a session's first frame: two frames for [`crate::Rate::Luminance`], the first at the full rate, so that the
/// next one follows a frame that itself followed one; all of the search for the `oracle`. `seed` is of the frames.
///
/// # Errors
/// The device's.
pub fn prepare(session: &mut Session, world: &World, config: &Config, oracle: bool, device: &Options, seed: u32) -> Result<()> {
    if oracle {
        return session.set_levels(&oracle::levels(world, config, device, seed)?);
    }
    if config.rate == crate::Rate::Luminance {
        session.frame([seed, 1])?;
        session.frame([seed, 2])?;
    }
    Ok(())
}
