//! Lights of UsdLux.
//!
//! Their radiance is `intensity` · 2^`exposure` · `color` · that of `colorTemperature`; with `normalize` over the area of the light
//! in the world, so that its power stays as it is moved and scaled. A radiance of 1 nit is 1 in the scene; lengths are those of the
//! stage, since UsdLux has no other (`metersPerUnit` does not count there either).
//!
//! | UsdLux | here |
//! |---|---|
//! | `SphereLight`, `DiskLight`, `RectLight`, `CylinderLight` | a shape with an `area` emitter |
//! | `SphereLight` with `treatAsPoint` | `point` of the intensity L π r² |
//! | `SphereLight` with a `shaping:cone:angle` | `spot` of the same |
//! | `DistantLight` | `directional` of the irradiance L π sin² (`angle` / 2), `intensity` alone with `normalize` or without an angle |
//! | `DomeLight` | `envmap`, or `constant` without a picture |
//! | `MeshLightAPI`, `GeometryLight` | the emission of the mesh |

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use super::assets::StageAssets;
use super::prim::PrimReader;
use super::textures::{StagePictures, upside_down};
use crate::color::{cie, profile};
use crate::scene::diagnostic::shorten;
use crate::scene::model::picture_changes::{Change, ChannelUse, ScaledChannels};
use crate::scene::model::stage::looking;
use crate::scene::model::surface::{is_grey, luminance};
use crate::scene::model::text::SceneText;
use crate::spectrum::blackbody;

/// The types of prims that [`StageLight::read`] knows.
pub(super) const KINDS: &[&str] =
    &["DistantLight", "SphereLight", "RectLight", "DiskLight", "CylinderLight", "DomeLight", "DomeLight_1"];

/// The light of a prim, before its size in the world is known.
#[derive(Clone, Debug)]
pub(super) struct EmittedLight {
    /// Radiance in nits; over the area of the light if that is asked for.
    pub(super) rgb: [f32; 3],
    pub(super) normalize: bool,
}

impl EmittedLight {
    /// Reads `inputs:intensity` and what else scales it.
    pub(super) fn read(prim: &PrimReader, default_intensity: f64) -> Self {
        let number = |name: &str, default: f64| prim.number(name).unwrap_or(default);
        let power = number("inputs:intensity", default_intensity) * number("inputs:exposure", 0.0).exp2();
        let mut rgb = prim.rgb("inputs:color").unwrap_or([1.0; 3]);
        let kelvin = number("inputs:colorTemperature", 6500.0);
        if prim.truth("inputs:enableColorTemperature") == Some(true) {
            let tint = color_of_temperature(kelvin);
            rgb = std::array::from_fn(|i| rgb[i] * tint[i]);
        }
        for (name, default) in [("inputs:diffuse", 1.0), ("inputs:specular", 1.0)] {
            if number(name, default) != default {
                prim.fault(format!("`{name}` of a light is not used: light is the same for all reflections"));
            }
        }
        let normalize = prim.truth("inputs:normalize") == Some(true);
        let rgb = rgb.map(|v| (f64::from(v) * power).clamp(0.0, 1e30) as f32);
        Self { rgb, normalize }
    }

    /// The radiance of a light of this area.
    pub(super) fn radiance(&self, area: f64) -> [f32; 3] {
        match self.normalize && area > 0.0 {
            true => self.rgb.map(|v| (f64::from(v) / area) as f32),
            false => self.rgb,
        }
    }
}

/// Linear colour of a black body of this temperature in kelvin, of luminance 1.
fn color_of_temperature(kelvin: f64) -> [f32; 3] {
    let kelvin = kelvin.clamp(1000.0, 10_000.0);
    let xyz = cie::integrate(|nm, _| blackbody::radiance(f64::from(nm), kelvin));
    let rgb = profile::rec709_from_xyz() * (xyz / xyz.y).as_vec3();
    rgb.max(glam::Vec3::ZERO).to_array()
}

/// The form of a light.
#[derive(Clone, Debug)]
enum LightForm {
    Distant { angle: f64 },
    Sphere { radius: f64, as_point: bool },
    Rect { width: f64, height: f64 },
    Disk { radius: f64 },
    Cylinder { radius: f64, length: f64 },
    Dome,
}

/// A light of a stage.
#[derive(Clone, Debug)]
pub(super) struct StageLight {
    path: String,
    form: LightForm,
    emitted: EmittedLight,
    /// Where its picture is.
    texture: Option<String>,
    /// Angle of its cone and share of it that is soft.
    cone: Option<[f64; 2]>,
}

impl StageLight {
    /// Reads a light.
    pub(super) fn read(prim: &PrimReader) -> Self {
        let number = |name: &str, default: f64| prim.number(&format!("inputs:{name}")).unwrap_or(default);
        let form = match prim.kind.as_str() {
            "DistantLight" => LightForm::Distant { angle: number("angle", 0.53) },
            "RectLight" => LightForm::Rect { width: number("width", 1.0), height: number("height", 1.0) },
            "DiskLight" => LightForm::Disk { radius: number("radius", 0.5) },
            "CylinderLight" => {
                if prim.truth("treatAsLine") == Some(true) {
                    prim.fault("`treatAsLine` is not used: the light is a cylinder");
                }
                LightForm::Cylinder { radius: number("radius", 0.5), length: number("length", 1.0) }
            }
            "SphereLight" => {
                let as_point = prim.truth("treatAsPoint") == Some(true);
                LightForm::Sphere { radius: number("radius", 0.5), as_point }
            }
            _ => LightForm::Dome,
        };
        let default = if matches!(form, LightForm::Distant { .. }) { 50_000.0 } else { 1.0 };
        let emitted = EmittedLight::read(prim, default);
        let texture = prim.asset("inputs:texture:file").and_then(|(name, found)| {
            if found.is_none() {
                prim.fault(format!("the picture `{}` of a light is not found and not used", shorten(&name)));
            }
            found
        });
        let format = prim.word("inputs:texture:format").unwrap_or_else(|| "automatic".to_owned());
        if !["automatic", "latlong"].contains(&format.as_str()) && texture.is_some() {
            prim.fault(format!(
                "a picture all around of the format `{}` is taken as latlong",
                shorten(&format)
            ));
        }
        if prim.word("poleAxis").is_some_and(|axis| !["scene", "Y"].contains(&axis.as_str())) {
            prim.fault("`poleAxis` of a dome is not used: its pole is y");
        }
        // The size of a helper of editors, and light that passes through portals alone.
        prim.used("guideRadius");
        Self { path: prim.path.clone(), form, emitted, texture, cone: cone(prim) }
    }

    /// Writes the light at its place.
    pub(super) fn write(
        &self,
        text: &mut SceneText<'_>,
        to_world: &DAffine3,
        pictures: &mut StagePictures,
        assets: &StageAssets,
    ) {
        let id = text.id(self.path.rsplit('/').next().unwrap_or("light"));
        let scales = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| to_world.transform_vector3(axis).length());
        // UsdLux measures lights in the world.
        let mean = (scales[0] * scales[1] * scales[2]).cbrt();
        let is_even = scales.iter().all(|s| (s - mean).abs() <= 1e-3 * mean);
        if !is_even && matches!(self.form, LightForm::Sphere { .. } | LightForm::Cylinder { .. }) {
            text.tell("a light that is scaled differently along its axes has their mean", &self.path);
        }
        if self.cone.is_some_and(|[angle, _]| angle < 90.0) && !matches!(self.form, LightForm::Sphere { .. })
        {
            text.tell("the cone of a light that is no sphere is not used", &self.path);
        }
        if self.texture.is_some() && !matches!(self.form, LightForm::Rect { .. } | LightForm::Dome) {
            text.tell(
                "the picture of a light that is neither a rectangle nor a dome is not used",
                &self.path,
            );
        }
        let size = |v: f64, scale: f64| (v * scale).abs();
        match self.form {
            LightForm::Distant { angle } => self.distant(text, &id, to_world, angle),
            LightForm::Dome => self.dome(text, &id, to_world, pictures, assets),
            LightForm::Sphere { radius, as_point } => {
                let radius = size(radius, mean);
                if as_point || self.cone.is_some() || radius == 0.0 {
                    self.point(text, &id, to_world, radius);
                } else {
                    let rgb = self.emitted.radiance(4.0 * PI * radius * radius);
                    self.shape(text, "sphere", &id, LampEmission::Rgb(rgb), |text| {
                        text.value("point", "center", words(to_world.translation));
                        text.value("float", "radius", radius);
                    });
                }
            }
            LightForm::Rect { width, height } => {
                let area = size(width, scales[0]) * size(height, scales[1]);
                let picture =
                    self.texture.as_ref().and_then(|file| self.picture(text, file, area, pictures, assets));
                let emission = picture.unwrap_or_else(|| LampEmission::Rgb(self.emitted.radiance(area)));
                let place = *to_world * facing(0.5 * width, 0.5 * height);
                self.flat(text, "rectangle", &id, &place, emission);
            }
            LightForm::Disk { radius } => {
                let area = PI * size(radius, scales[0]) * size(radius, scales[1]);
                let emission = LampEmission::Rgb(self.emitted.radiance(area));
                self.flat(text, "disk", &id, &(*to_world * facing(radius, radius)), emission);
            }
            LightForm::Cylinder { radius, length } => {
                let across = size(radius, (scales[1] * scales[2]).sqrt());
                let area = 2.0 * PI * across * size(length, scales[0]);
                let ends = [-0.5, 0.5].map(|x| to_world.transform_point3(DVec3::new(x * length, 0.0, 0.0)));
                if !(area.is_normal() && ends[0] != ends[1]) {
                    return text.tell("a light without extent is left out", &self.path);
                }
                self.shape(text, "cylinder", &id, LampEmission::Rgb(self.emitted.radiance(area)), |text| {
                    text.value("point", "p0", words(ends[0]));
                    text.value("point", "p1", words(ends[1]));
                    text.value("float", "radius", across);
                });
            }
        }
    }

    /// A shape that emits.
    fn shape(
        &self,
        text: &mut SceneText<'_>,
        kind: &str,
        id: &str,
        emission: LampEmission,
        inside: impl FnOnce(&mut SceneText<'_>),
    ) {
        text.lit = true;
        text.object("shape", kind, &[("id", id)], |text| {
            inside(text);
            text.object("emitter", "area", &[], |text| match emission {
                LampEmission::Rgb(rgb) => text.rgb("radiance", rgb),
                LampEmission::Picture(file) => {
                    text.object("texture", "bitmap", &[("name", "radiance")], |text| {
                        text.value("string", "filename", file);
                        text.value("boolean", "raw", true);
                        // Who is lit sees the picture upright; a rectangle has it the other way round.
                        text.value("string", "wrap_mode", "clamp");
                        text.transform("to_uv", &upside_down());
                    })
                }
            });
        });
    }

    fn flat(&self, text: &mut SceneText<'_>, kind: &str, id: &str, place: &DAffine3, emission: LampEmission) {
        if !(place.is_finite() && place.matrix3.determinant().is_normal()) {
            return text.tell("a light without extent is left out", &self.path);
        }
        self.shape(text, kind, id, emission, |text| text.transform("to_world", place));
    }

    /// A light that is as small as a point, or has a cone.
    fn point(&self, text: &mut SceneText<'_>, id: &str, to_world: &DAffine3, radius: f64) {
        // A sphere shows π r² of its area of 4 π r² to any side.
        let seen = match self.emitted.normalize {
            true => 0.25,
            false => PI * radius * radius,
        };
        let rgb = self.emitted.rgb.map(|v| (f64::from(v) * seen) as f32);
        if rgb == [0.0; 3] {
            return text.tell("a light without extent is left out", &self.path);
        }
        text.lit = true;
        let Some([angle, softness]) = self.cone else {
            return text.object("emitter", "point", &[("id", id)], |text| {
                text.value("point", "position", words(to_world.translation));
                text.rgb("intensity", rgb);
            });
        };
        text.tell("a light with a cone is a spot without extent", &self.path);
        text.object("emitter", "spot", &[("id", id)], |text| {
            text.transform("to_world", &looking(to_world));
            text.rgb("intensity", rgb);
            text.value("float", "cutoff_angle", angle);
            text.value("float", "beam_width", angle * (1.0 - softness));
        });
    }

    fn distant(&self, text: &mut SceneText<'_>, id: &str, to_world: &DAffine3, angle: f64) {
        let half = (0.5 * angle.abs()).to_radians().min(0.5 * PI);
        let share = match self.emitted.normalize || half == 0.0 {
            true => 1.0,
            false => PI * half.sin().powi(2),
        };
        if half > 0.0 {
            text.tell("a distant light with an angle has sharp shadows: it is a direction here", &self.path);
        }
        text.lit = true;
        text.object("emitter", "directional", &[("id", id)], |text| {
            text.value("vector", "direction", words(to_world.transform_vector3(DVec3::NEG_Z)));
            text.rgb("irradiance", self.emitted.rgb.map(|v| (f64::from(v) * share) as f32));
        });
    }

    fn dome(
        &self,
        text: &mut SceneText<'_>,
        id: &str,
        to_world: &DAffine3,
        pictures: &mut StagePictures,
        assets: &StageAssets,
    ) {
        if text.domed {
            return text.tell("the stage has one light all around: others are not used", &self.path);
        }
        let rgb = self.emitted.rgb;
        let wide = |file: &str| {
            let end = file.trim_end_matches(']').rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
            ["exr", "hdr", "pfm"].contains(&end.as_str())
        };
        let (file, scale) = match &self.texture {
            None => (None, 1.0),
            Some(file) if wide(file) => {
                if !is_grey(rgb) {
                    text.tell("the colour of a dome with a picture counts by its luminance", &self.path);
                }
                (Some(pictures.file(file, Change::None, assets, text)), luminance(rgb))
            }
            Some(file) => (Some(pictures.file(file, light(rgb), assets, text)), 1.0),
        };
        let file = match file {
            Some(Err(error)) => {
                text.tell(error, &self.path);
                None
            }
            Some(Ok(file)) => Some(file),
            None => None,
        };
        text.lit = true;
        text.domed = true;
        let Some(file) = file else {
            return text.object("emitter", "constant", &[("id", id)], |text| text.rgb("radiance", rgb));
        };
        let turn = |m: DMat3| {
            let x = m.x_axis.normalize_or(DVec3::X);
            let y = (m.y_axis - x * m.y_axis.dot(x)).normalize_or(x.any_orthonormal_vector());
            let z = x.cross(y);
            DAffine3::from_mat3(DMat3::from_cols(x, y, if z.dot(m.z_axis) < 0.0 { -z } else { z }))
        };
        text.object("emitter", "envmap", &[("id", id)], |text| {
            text.value("string", "filename", file);
            text.value("float", "scale", scale);
            text.transform("to_world", &turn(to_world.matrix3));
        });
    }

    /// The picture of a rectangle, times its radiance.
    fn picture(
        &self,
        text: &mut SceneText<'_>,
        file: &str,
        area: f64,
        pictures: &mut StagePictures,
        assets: &StageAssets,
    ) -> Option<LampEmission> {
        let made = pictures.file(file, light(self.emitted.radiance(area)), assets, text);
        let made = made
            .map_err(|error| text.tell(format!("the picture of a light is not used: {error}"), &self.path));
        made.ok().map(LampEmission::Picture)
    }
}

/// The emission of a shape: a colour, or the picture in a file.
enum LampEmission {
    Rgb([f32; 3]),
    Picture(String),
}

/// A picture as light, times this.
fn light([r, g, b]: [f32; 3]) -> Change {
    let then = ChannelUse::Light;
    Change::Scaled(ScaledChannels {
        channel: None,
        scale: [r, g, b, 1.0],
        bias: [0.0; 4],
        linear: false,
        then,
    })
}

/// From the unit square or disk, which faces +z, to one of these half extents that faces −z.
fn facing(x: f64, y: f64) -> DAffine3 {
    DAffine3::from_rotation_y(PI) * DAffine3::from_scale(DVec3::new(x, y, x.abs().max(y.abs())))
}

/// The cone of `ShapingAPI`; none where light goes everywhere.
fn cone(prim: &PrimReader) -> Option<[f64; 2]> {
    let angle = prim.number("inputs:shaping:cone:angle");
    let softness = prim.number("inputs:shaping:cone:softness").unwrap_or(0.0).clamp(0.0, 1.0);
    for (name, what) in [("inputs:shaping:focus", "focus"), ("inputs:shaping:ies:file", "profile (IES)")] {
        let given = if name.ends_with("file") {
            prim.asset(name).is_some()
        } else {
            prim.number(name).unwrap_or(0.0) != 0.0
        };
        if given {
            prim.fault(format!("the {what} of a light is not used"));
        }
    }
    ["inputs:shaping:focusTint", "inputs:shaping:ies:angleScale", "inputs:shaping:ies:normalize"]
        .iter()
        .for_each(|name| prim.used(name));
    angle.filter(|angle| *angle < 180.0).map(|angle| [angle.max(0.1), softness])
}

fn words(v: DVec3) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}
