//! Numbers of a camera that are out of range.

use crate::scene::desc::{CameraDesc, LensDesc, MeterSurface, PerspectiveDesc, ProjectionDesc};

/// Why numbers of a projection are out of range.
pub(super) fn check(desc: &CameraDesc) -> Result<(), &'static str> {
    match &desc.projection {
        ProjectionDesc::Perspective(PerspectiveDesc { fov, lens, distortion, .. }) => {
            let LensDesc { radius, focus_distance, blades, blade_rotation, squeeze } = *lens;
            let bends = distortion.is_some_and(|d| {
                !d.radial.into_iter().chain(d.tangential).chain(d.prism).all(f64::is_finite)
            });
            match () {
                () if !(*fov > 0.0 && *fov < 180.0) => {
                    Err("the field of view must lie between 0 and 180 degrees")
                }
                () if !(radius.is_finite() && radius >= 0.0) => {
                    Err("aperture_radius must be 0, for a pinhole, or above")
                }
                () if radius > 0.0 && !(focus_distance.is_normal() && focus_distance > 0.0) => {
                    Err("focus_distance must be above 0 where there is an aperture")
                }
                () if matches!(blades, 1 | 2) => Err("an aperture has three blades or more, or none"),
                () if !(squeeze.is_normal() && squeeze > 0.0 && blade_rotation.is_finite()) => {
                    Err("the squeeze of a lens must be above 0, and its rotation finite")
                }
                () if bends => Err("the coefficients of a distortion must be finite"),
                () => Ok(()),
            }
        }
        ProjectionDesc::Fisheye(f) => {
            let widest = 2.0 * f.mapping.largest_angle();
            let fits = f.fov > 0.0 && f.fov <= widest && f.image_circle > 0.0;
            match fits && f.distortion.into_iter().all(f64::is_finite) {
                true => Ok(()),
                false => Err(
                    "the field of view of a fisheye lens is above 0 and fits its mapping; its coefficients are finite",
                ),
            }
        }
        ProjectionDesc::Stereo(stereo) if !(stereo.interocular >= 0.0 && stereo.interocular.is_finite()) => {
            Err("the distance of the eyes must be 0 or above")
        }
        ProjectionDesc::Beam(radius) if !(*radius >= 0.0 && radius.is_finite()) => {
            Err("the radius of a beam must be 0 or above")
        }
        ProjectionDesc::Irradiance(surface) => {
            let gram = desc.to_world.matrix3.transpose() * desc.to_world.matrix3;
            let squares = gram.x_axis.x.min(gram.y_axis.y).min(gram.z_axis.z);
            let off = [gram.x_axis.y, gram.x_axis.z, gram.y_axis.z];
            let even = gram.x_axis.x.max(gram.y_axis.y).max(gram.z_axis.z) <= squares * (1.0 + 1e-6);
            match off.into_iter().all(|v| v.abs() <= 1e-6 * squares) {
                false => Err("the shape of a meter cannot be sheared"),
                true if matches!(surface, MeterSurface::Sphere { .. }) && !even => {
                    Err("the sphere of a meter must be scaled alike along all axes")
                }
                true => Ok(()),
            }
        }
        ProjectionDesc::Batch(cameras) if cameras.is_empty() => Err("a batch of cameras needs one or more"),
        _ => Ok(()),
    }
}
