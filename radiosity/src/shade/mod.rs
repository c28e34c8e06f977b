//! From patches to what the eye sees.
//!
//! [`ShadedSurfaces`] spreads a value a patch over the surfaces, smooth or flat; [`picture()`] looks at them through a
//! camera and stays in linear light; [`ToneCurve`] takes a picture to the eight bits of a screen. [`frame`] finds a
//! camera where the author left none, [`automatic_exposure`] an exposure. An [`Atlas`] lays the surfaces out in one texture,
//! for light maps.

mod atlas;
mod backs;
mod crease;
mod exposure;
mod framing;
mod gather;
mod joints;
mod lamps;
mod picture;
mod smooth;
mod straight;
mod tone;

pub use atlas::{Atlas, AtlasError, MAX_ATLAS_SIDE, MIN_ATLAS_SIDE, PADDING};
pub use backs::backs_seen;
pub use crease::PieceCorners;
pub use exposure::automatic_exposure;
pub use framing::frame;
pub use gather::{FinalGather, GatherError, gathered_picture, gathered_screen_picture};
pub use joints::Joints;
pub use picture::{
    MAX_PICTURE_PIXELS, MAX_PICTURE_SIDE, MAX_SAMPLING, Picture, PictureArea, PictureError, PictureRequest,
    ScreenPicture, fit, picture, screen_picture,
};
pub use smooth::{ShadedSurfaces, Shading};
pub use straight::straight_variation;
pub use tone::{ToneCurve, ToneMap, linear_from_srgb, srgb_from_linear, tone_map};
