//! Rates that `bandwidth` is compared with: what shipped image-based variable-rate shading does, and the least that any rate
//! needs. Both give [`crate::Rate::Given`] its levels and are worked out on the CPU, outside of the frame's time.

pub mod luminance;
pub mod oracle;

use crate::Config;
use crate::offline::error::Result;
use crate::offline::headless::Options;
use crate::offline::session::Session;
use crate::offline::world::World;

/// Who gives the levels of [`crate::Rate::Given`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Given {
    /// The contrast of the frame before ([`luminance`]).
    Luminance,
    /// A search for the fewest samples for the error of [`crate::Rate::Bandwidth`] ([`oracle`]).
    Oracle,
}

impl Given {
    /// As `--rate` calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Luminance => "luminance",
            Self::Oracle => "oracle",
        }
    }

    /// What comes before a session's first frame: two frames for `luminance`, the first at the full rate, so that the next one
    /// follows a frame that itself followed one; all of the search for `oracle`. `seed` is of the frames.
    ///
    /// # Errors
    /// The device's.
    pub fn prepare(self, session: &mut Session, world: &World, config: &Config, device: &Options, seed: u32) -> Result<()> {
        match self {
            Self::Luminance => {
                let samples = config.extent.map(|e| (e * config.samples_per_side) as usize);
                session.set_levels(&vec![0; samples[0] * samples[1]])?;
                session.frame([seed, 1])?;
                self.follow(session, config)?;
                session.frame([seed, 2])
            }
            Self::Oracle => session.set_levels(&oracle::levels(world, config, device, seed)?),
        }
    }

    /// What comes before every frame: `luminance` looks at the frame before.
    ///
    /// # Errors
    /// The device's.
    pub fn follow(self, session: &mut Session, config: &Config) -> Result<()> {
        if self != Self::Luminance {
            return Ok(());
        }
        let (bytes, ..) = session.image("resolved")?;
        let previous: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        session.set_levels(&luminance::levels(&previous, config.extent, config.samples_per_side, luminance::NOTICEABLE))
    }
}
