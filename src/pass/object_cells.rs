//! Cells of directions that each object has of its own, in camera space: where they are, and the images that `texture_space` and
//! `vmf_mips` write in every frame (Xu et al. 2017, section 4).

use crate::distribution::Filter;
use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::pipeline::Sets;
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Handle, Retired};
use crate::pass::brdf_map;
use crate::pass::gbuffer::Draw;
use crate::pass::maps::{Divided, MapImages};
use crate::pass::vmf_mips::VmfMips;
use ash::vk;

/// Format of a texel's frame: world normal; tangent as `glsl/include/tangent.glsl` encodes it. All zero for none.
pub(crate) const FRAMES: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// Where the cells of an object are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Seat {
    pub material: u32,
    /// Class of its cells.
    class: usize,
    /// Among the objects there: the layer of its frames.
    pub number: usize,
    /// The first of its cells.
    pub cell_layer: usize,
}

/// Seats by object number.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Seats(Vec<Option<Seat>>);

/// Images of all objects whose maps have one size.
pub(crate) struct Images {
    /// Class of the cells, and of the moments that they are made of.
    class: usize,
    pub moments: usize,
    /// A layer an object.
    pub frames: Image,
    pub frame_views: Vec<vk::ImageView>,
    pub cells: Image,
    /// The views of levels in the sets.
    views: Vec<vk::ImageView>,
    /// Sets of `vmf_mips`.
    pub first: Sets,
    pub levels: Sets,
}

pub(crate) struct ObjectCells {
    seats: Seats,
    images: Vec<Images>,
    /// Where each object's cells are, as `glsl/filter.comp` reads it.
    table: Buffer,
}

impl Seats {
    /// Of `draws`: of those whose material has cells for its objects.
    pub fn of(draws: &[Draw], maps: &MapImages) -> Result<Self> {
        let mut seats: Vec<Option<Seat>> = Vec::new();
        for (i, draw, divided) in divided(draws, maps) {
            let object = draw.object as usize;
            if seats.len() <= object {
                seats.resize(object + 1, None);
            }
            let before = seats.iter().flatten().filter(|seat| seat.class == divided.cells);
            let last = before.max_by_key(|seat| seat.number);
            let layers = |seat: &Seat| maps.divided(seat.material).map_or(0, |d| d.layers);
            let (number, cell_layer) = last.map_or((0, 0), |seat| (seat.number + 1, seat.cell_layer + layers(seat)));
            match seats.get_mut(object) {
                Some(seat @ None) => {
                    *seat = Some(Seat { material: draw.material, class: divided.cells, number, cell_layer });
                }
                _ => return Err(shared(i, draw)),
            }
        }
        Ok(Self(seats))
    }

    fn of_class(&self, class: usize) -> impl Iterator<Item = &Seat> {
        self.0.iter().flatten().filter(move |seat| seat.class == class)
    }
}

/// Draws whose material has cells for its objects, by number.
fn divided<'a>(draws: &'a [Draw], maps: &'a MapImages) -> impl Iterator<Item = (usize, &'a Draw, &'a Divided)> {
    draws.iter().enumerate().filter_map(|(i, draw)| Some((i, draw, maps.divided(draw.material)?)))
}

fn shared(i: usize, draw: &Draw) -> Error {
    Error::invalid(format!("draws[{i}].object"), "a number that no other draw has, as bins are camera", draw.object)
}

impl Images {
    fn new(build: &mut Build<'_>, mips: &VmfMips, maps: &MapImages, of: &Divided, [objects, layers]: [usize; 2]) -> Result<Self> {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_SRC;
        let desc = ImageDesc::new("frames", FRAMES, [of.size[0], of.size[1], 1], usage);
        let frames = Image::new(build, ImageDesc { layers: Some(objects as u32), ..desc })?;
        let frame_views = frames.layer_views(build)?;
        let cells = brdf_map::coarser(build, Filter::Vmf8, of.size, layers)?;
        let mut views = cells.level_views(build)?;
        let moments = maps.class(of.moments).level_views(build)?;
        let lobes = moments.first().copied().unwrap_or_default();
        let [first, levels] = mips.object_sets(build, lobes, &views, frames.view)?;
        views.extend(moments);
        Ok(Self { class: of.cells, moments: of.moments, frames, frame_views, cells, views, first, levels })
    }

    fn retire(self, states: &mut States, bag: &mut Retired) {
        self.frame_views.into_iter().chain(self.views).for_each(|view| bag.push(Handle::View(view)));
        for image in [self.frames, self.cells] {
            states.forget(image.handle);
            image.retire(bag);
        }
        self.first.retire(bag);
        self.levels.retire(bag);
    }
}

impl ObjectCells {
    pub fn new(build: &mut Build<'_>, mips: &VmfMips, maps: &MapImages, seats: Seats) -> Result<Self> {
        let mut images: Vec<Images> = Vec::new();
        for seat in seats.0.iter().flatten() {
            let Some(of) = maps.divided(seat.material).filter(|of| images.iter().all(|i| i.class != of.cells)) else { continue };
            let layers = |seat: &Seat| maps.divided(seat.material).map_or(0, |d| d.layers);
            let counts = [seats.of_class(of.cells).count(), seats.of_class(of.cells).map(layers).sum()];
            images.push(Images::new(build, mips, maps, of, counts)?);
        }
        let code = |seat: &Option<Seat>| seat.map_or(0, |seat| crate::pass::maps::code(Some((seat.class, seat.cell_layer))));
        let codes: Vec<u32> = seats.0.iter().map(code).chain([0]).collect();
        let bytes: &[u8] = bytemuck::cast_slice(&codes);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let mut table = Buffer::new(build, "objects", bytes.len() as u64, usage, Location::Upload)?;
        table.bytes_mut().copy_from_slice(bytes);
        Ok(Self { seats, images, table })
    }

    pub fn seats(&self) -> &Seats {
        &self.seats
    }

    /// Refuses draws without a seat of their own.
    pub fn check(&self, draws: &[Draw], maps: &MapImages) -> Result<()> {
        let mut taken = vec![false; self.seats.0.len()];
        for (i, draw, _) in divided(draws, maps) {
            let object = draw.object as usize;
            let seat = self.seats.0.get(object).copied().flatten().filter(|seat| seat.material == draw.material);
            match taken.get_mut(object).filter(|_| seat.is_some()) {
                Some(taken) if !*taken => *taken = true,
                Some(_) => return Err(shared(i, draw)),
                None => {
                    let expected = format!("an object that reserve_cells was given with material {}", draw.material);
                    return Err(Error::invalid(format!("draws[{i}].object"), expected, draw.object));
                }
            }
        }
        Ok(())
    }

    /// The draws that have a seat.
    pub fn seated<'a>(&'a self, draws: &'a [Draw]) -> impl Iterator<Item = (&'a Draw, &'a Seat, &'a Images)> {
        draws.iter().filter_map(|draw| {
            let seat = self.seats.0.get(draw.object as usize)?.as_ref().filter(|seat| seat.material == draw.material)?;
            Some((draw, seat, self.images.iter().find(|images| images.class == seat.class)?))
        })
    }

    pub fn images(&self) -> impl Iterator<Item = &Images> {
        self.images.iter()
    }

    pub fn table(&self) -> &Buffer {
        &self.table
    }

    /// The cells of class `class`.
    pub fn class(&self, class: usize) -> Option<&Image> {
        self.images.iter().find(|images| images.class == class).map(|images| &images.cells)
    }

    /// Declares everything read by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        self.images.iter().for_each(|images| rec.image(&images.cells, Access::COMPUTE_SAMPLED));
    }

    /// The arrays of an object's frames and of its cells, and its layers there.
    #[cfg(feature = "offline")]
    pub fn arrays(&self, object: u32, maps: &MapImages) -> Option<crate::pass::maps::MomentArrays<'_>> {
        let seat = self.seats.0.get(object as usize)?.as_ref()?;
        let images = self.images.iter().find(|images| images.class == seat.class)?;
        let (frame, first) = (seat.number as u32, seat.cell_layer as u32);
        let layers = maps.divided(seat.material)?.layers as u32;
        Some([Some((&images.frames, frame..frame + 1)), Some((&images.cells, first..first + layers))])
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        self.images.into_iter().for_each(|images| images.retire(states, bag));
        self.table.retire(bag);
    }
}
