//! Radiosity of diffuse scenes.
//!
//! Every surface reflects alike in all directions, so one number a patch and channel tells all that leaves
//! it: its *radiosity* B, a power per area. It is what the patch emits and what it reflects of the light
//! that all others send it,
//!
//! ```text
//! B_i = E_i + ρ_i Σ_j F_ij B_j
//! ```
//!
//! where the *form factor* F_ij is the share of the energy leaving i that arrives at j. The answer depends on
//! no viewpoint: solve once, then walk about.
//!
//! Light travels one way, and so does this library. Five values are all of it, each made from those before
//! it and never written to again:
//!
//! ```text
//! Scene -> Patches -> FormFactors -> Solution -> Picture
//! ```
//!
//! # Scene
//!
//! [`scene::read`] reads a file; here the text is at hand. A floor, and a lamp that faces it:
//!
//! ```
//! use radiosity::scene::n3d;
//!
//! let scene = n3d::parse_scene("two_plates.scn", b"
//!     QD 6 6   0 0 0  0 0 1  1 0 1  1 0 0    CD .5 .5 .5  ID   # faces up, +y
//!     QD 2 2   0 1 0  1 1 0  1 1 1  0 1 1    CE 20 20 20  ID   # faces down
//! ").unwrap();
//! assert_eq!(scene.surfaces.len(), 2);
//! ```
//!
//! # Patches
//!
//! [`patches::subdivide`] cuts each surface as its author asked (n x m), times a factor; or by size, or into about so many
//! ([`patches::Subdivision`]).
//!
//! ```
//! # use radiosity::scene::n3d;
//! # let scene = n3d::parse_scene("", b"QD 6 6 0 0 0 0 0 1 1 0 1 1 0 0 CD .5 .5 .5 ID QD 2 2 0 1 0 1 1 0 1 1 1 0 1 1 CE 20 20 20 ID").unwrap();
//! let patches = radiosity::patches::subdivide(&scene, 1.0).unwrap();
//! assert_eq!(patches.len(), 36 + 4);
//! assert!((patches.total_power().r - 20.0).abs() < 1e-12); // area times emission
//! ```
//!
//! # Form factors
//!
//! A [`Hemicube`](form_factors::hemicube::Hemicube) finds one row; [`form_factors::compute_rows`] runs it, or
//! a closure of your own, over all patches in parallel.
//!
//! ```
//! # use radiosity::scene::n3d;
//! # let scene = n3d::parse_scene("", b"QD 6 6 0 0 0 0 0 1 1 0 1 1 0 0 CD .5 .5 .5 ID QD 2 2 0 1 0 1 1 0 1 1 1 0 1 1 CE 20 20 20 ID").unwrap();
//! # let patches = radiosity::patches::subdivide(&scene, 1.0).unwrap();
//! use radiosity::form_factors::{compute_rows, hemicube::{CellWeights, Hemicube, Scratch}};
//! use radiosity::visibility::Facets;
//! use radiosity::watch::ignore;
//!
//! let facets = Facets::new(&scene, &patches);
//! let hemicube = Hemicube::new(&patches, &facets, scene.back_faces, CellWeights::new(100).unwrap());
//! let row = |patch, scratch: &mut Scratch| hemicube.row(patch, scratch);
//! let factors = compute_rows(patches.len(), 0, Scratch::default, row, &mut ignore).unwrap();
//!
//! // From the lamp's four patches to the floor: unit squares face to face, 0.1998 by the catalogues.
//! let to_floor: f64 = (36..40).map(|i| factors.row(i).sum() / 4.0).sum();
//! assert!((to_floor - 0.1998).abs() < 0.01);
//! ```
//!
//! # Solution
//!
//! [`solve::gauss_seidel`] runs until the answer moves by no more than epsilon. For a program that shows every
//! sweep, [`solve::GaussSeidel`] does one at a time. [`bake::bake`] is the whole recipe in one call, and [`refine::refine`]
//! quarters patches until the light is known as well as asked.
//!
//! ```
//! # use radiosity::scene::n3d;
//! # let scene = n3d::parse_scene("", b"QD 6 6 0 0 0 0 0 1 1 0 1 1 0 0 CD .5 .5 .5 ID QD 2 2 0 1 0 1 1 0 1 1 1 0 1 1 CE 20 20 20 ID").unwrap();
//! use radiosity::bake::{Request, Run, bake};
//! use radiosity::watch::ignore;
//!
//! let baked = bake(&scene, &Request::default(), &Run::default(), &mut ignore).unwrap();
//! let (centre, corner) = (&baked.solution.radiosity[14], &baked.solution.radiosity[0]);
//! assert!(centre.r > corner.r && corner.r > 0.0);
//! ```
//!
//! # Picture
//!
//! [`shade::ShadedSurfaces`] spreads the patches' values over the surfaces, [`shade::picture`] looks at them
//! through a camera, in linear light, and [`shade::tone_map`] makes of that what a screen can show.
//!
//! ```
//! # use radiosity::scene::n3d;
//! # let scene = n3d::parse_scene("", b"QD 6 6 0 0 0 0 0 1 1 0 1 1 0 0 CD .5 .5 .5 ID QD 2 2 0 1 0 1 1 0 1 1 1 0 1 1 CE 20 20 20 ID").unwrap();
//! # use radiosity::bake::{Request, Run, bake};
//! # let baked = bake(&scene, &Request::default(), &Run::default(), &mut radiosity::watch::ignore).unwrap();
//! use radiosity::shade::{PictureRequest, ShadedSurfaces, Shading, frame, picture};
//!
//! let light = &baked.solution.radiosity;
//! let surfaces = ShadedSurfaces::new(&scene, &baked.patches, &baked.facets, light, Shading::Smooth);
//! let request = PictureRequest { width: 160, height: 120, ..PictureRequest::default() };
//! let picture = picture(&surfaces, &frame(&scene), &request).unwrap();
//! assert!(picture.pixels.iter().any(|&[r, _, _]| r > 0.0));
//! ```

// In the order light travels: a module imports only from those above it.
pub mod geometry;
pub mod light;
pub mod watch;
pub mod simd;
pub mod scene;
pub mod patches;
pub mod visibility;
pub mod form_factors;
pub mod solve;
pub mod check;
pub mod estimate;
pub mod shade;
pub mod export;
pub mod bake;
pub mod refine;
