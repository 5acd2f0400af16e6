//! The part of a camera's image that a frame shows.

use crate::View;
use crate::offline::world::{Camera, World};
use glam::{DMat4, DVec2, DVec4, Mat4};

/// Near plane of the rasteriser as a fraction of the scene's reach; there is no far plane.
const NEAR: f64 = 1e-3;

/// A rectangle of an image, which may begin within a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Columns and rows of the whole image.
    pub image: [u32; 2],
    /// The upper left corner, in pixels from that of the image.
    pub corner: DVec2,
    /// Columns and rows, in pixels of the image.
    pub size: DVec2,
}

impl Window {
    /// All of an image.
    pub fn whole(image: [u32; 2]) -> Self {
        Self { image, corner: DVec2::ZERO, size: DVec2::from(image.map(f64::from)) }
    }

    /// The camera as matrices: reversed depth is not needed, as depth travels in the surface image at full precision.
    pub(super) fn view(&self, camera: &Camera, near: f64) -> View {
        let basis = camera.world_from_view();
        let world_from_view = DMat4::from_cols(
            basis.x_axis.extend(0.0),
            basis.y_axis.extend(0.0),
            basis.z_axis.extend(0.0),
            camera.position.extend(1.0),
        );
        let f = 1.0 / (camera.fov_y.to_radians() / 2.0).tan();
        let image = DVec2::from(self.image.map(f64::from));
        // In the whole image's coordinates from -1 to 1, of which Vulkan's y points down.
        let half = self.size / image;
        let centre = (2.0 * self.corner + self.size) / image - 1.0;
        let [x, y] = (centre / half).to_array();
        // Infinite far plane.
        let clip_from_view = DMat4::from_cols(
            DVec4::new(f * image.y / image.x / half.x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -f / half.y, 0.0, 0.0),
            DVec4::new(x, y, -1.0, -1.0),
            DVec4::new(0.0, 0.0, -near, 0.0),
        );
        let columns = |m: DMat4| -> [f32; 16] { Mat4::to_cols_array(&m.as_mat4()) };
        View { world_from_view: columns(world_from_view), clip_from_view: columns(clip_from_view) }
    }
}

/// A near plane that nothing visible crosses unless the camera stands inside an object.
pub(super) fn near(world: &World) -> f64 {
    let reach = world.objects.iter().map(|o| {
        let centre = o.transform().w_axis.truncate();
        centre.distance(world.camera.position)
    });
    (reach.fold(0.0, f64::max) * NEAR).max(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec4Swizzles};

    #[test]
    fn windows_show_what_the_whole_image_does() {
        let (position, target) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, -0.5, 0.2));
        let camera = Camera { position, target, up: DVec3::Y, fov_y: 50.0 };
        let image = [60, 40];
        let window = Window { image, corner: DVec2::new(12.25, 30.5), size: DVec2::new(8.0, 5.0) };
        // The view's rays against the camera's own.
        for (window, at) in [(Window::whole(image), DVec2::new(11.0, 7.5)), (window, DVec2::new(3.5, 1.25))] {
            let view = window.view(&camera, 0.1);
            assert!(view.validate().is_ok());
            let ray = camera.ray(window.corner + at, image);
            let clip = view.clip_from_world().as_dmat4() * (position + 4.0 * ray).extend(1.0);
            let pixel = (clip.xy() / clip.w + 1.0) / 2.0 * window.size;
            assert!((pixel - at).abs().max_element() < 1e-4, "{pixel} for {at}");
        }
    }
}
