//! The renderer's rates, and one that they are compared with: the least that any rate needs, which is worked out on the CPU, outside of
//! the frame's time, and given to [`crate::Rate::Given`].

pub mod oracle;

use crate::Config;
use crate::offline::error::Result;
use crate::offline::headless::Options;
use crate::offline::session::Session;
use crate::offline::world::World;

/// Where samples are shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// As the renderer itself decides.
    Own(crate::Rate),
    /// With the fewest samples for the error of [`crate::Rate::Bandwidth`] ([`oracle`]).
    Oracle,
}

impl From<crate::Rate> for Rate {
    fn from(rate: crate::Rate) -> Self {
        Self::Own(rate)
    }
}

impl Rate {
    /// The renderer's own rate.
    pub fn of_renderer(self) -> crate::Rate {
        match self {
            Self::Own(rate) => rate,
            Self::Oracle => crate::Rate::Given,
        }
    }

    /// As `--rate` calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Oracle => "oracle",
            Self::Own(crate::Rate::Full) => "full",
            Self::Own(crate::Rate::Uniform(1)) => "half",
            Self::Own(crate::Rate::Uniform(2)) => "quarter",
            Self::Own(crate::Rate::Uniform(_)) => "uniform",
            Self::Own(crate::Rate::Given) => "given",
            Self::Own(crate::Rate::Bandwidth) => "bandwidth",
            Self::Own(crate::Rate::Luminance) => "luminance",
        }
    }

    /// What comes before a session's first frame: two frames for `luminance`, the first at the full rate, so that the next one
    /// follows a frame that itself followed one; all of the search for `oracle`. `seed` is of the frames.
    ///
    /// # Errors
    /// The device's.
    pub fn prepare(self, session: &mut Session, world: &World, config: &Config, device: &Options, seed: u32) -> Result<()> {
        match self {
            Self::Own(crate::Rate::Luminance) => {
                session.frame([seed, 1])?;
                session.frame([seed, 2])
            }
            Self::Own(_) => Ok(()),
            Self::Oracle => session.set_levels(&oracle::levels(world, config, device, seed)?),
        }
    }
}
