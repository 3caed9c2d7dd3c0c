//! What this build holds: all effects, unless `POINTILLIST_WITHOUT` named some when it was compiled (`glsl/build.rs`).
//!
//! Only `tools/bench effects` makes builds that lack an effect, to show that one which is off costs nothing: a scene without it must be
//! traced as fast by the whole program as by one that has never heard of it. There the variants of an enum that belong to
//! the effect hold [`Absent`], which has no value, and the compiler drops them with all that they lead to.

use super::Effect;

macro_rules! effects {
    ($($name:literal $constant:ident $effect:ident $alias:ident $some:ident,)*) => {
        $(
            #[doc = concat!("This build has `", $name, "`.")]
            pub const $constant: bool = cfg!(has = $name);
            #[doc = concat!("`T`, or nothing in a build without `", $name, "`.")]
            #[cfg(has = $name)]
            pub type $alias<T> = T;
            #[doc = concat!("`T`, or nothing in a build without `", $name, "`.")]
            #[cfg(not(has = $name))]
            pub type $alias<T> = Absent<T>;
            #[doc = concat!("Makes a `", stringify!($alias), "`; in a build without it never called: scenes that call for it are refused.")]
            #[inline]
            #[cfg(has = $name)]
            pub fn $some<T>(value: T) -> $alias<T> {
                value
            }
            #[doc = concat!("Makes a `", stringify!($alias), "`: never called, since scenes that call for it are refused.")]
            #[cfg(not(has = $name))]
            pub fn $some<T>(_: T) -> $alias<T> {
                unreachable!(concat!("this build has no ", $name))
            }
        )*

        /// Nothing was left out.
        pub const IS_WHOLE: bool = $($constant)&&*;

        /// The first of `wanted` that this build lacks.
        pub fn lacking(wanted: impl Iterator<Item = Effect>) -> Option<Effect> {
            let has = |effect| match effect {
                $(Effect::$effect => $constant,)*
                _ => true,
            };
            wanted.into_iter().find(|effect| !has(*effect))
        }
    };
}

effects! {
    "dispersion" DISPERSION Dispersion IfDispersion if_dispersion,
    "transmission" TRANSMISSION Transmission IfTransmission if_transmission,
    "deltas" DELTAS Deltas IfDeltas if_deltas,
    "glossy" GLOSSY Glossy IfGlossy if_glossy,
    "environment" ENVIRONMENT Environment IfEnvironment if_environment,
    "light-choice" LIGHT_CHOICE LightChoice IfLightChoice if_light_choice,
    "lens" LENS Lens IfLens if_lens,
}

/// A `T` that there is not.
#[derive(Clone, Copy, Debug)]
pub struct Absent<T>(std::convert::Infallible, std::marker::PhantomData<T>);

impl<T> std::ops::Deref for Absent<T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self.0 {}
    }
}
