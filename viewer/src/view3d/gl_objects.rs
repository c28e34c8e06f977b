//! GL objects, each owned by one value and deleted with it: programs, lists of texels, vertices, targets to draw to.
//!
//! A GL object cannot be dropped without its context, so each has a `delete` that takes it. All functions want the
//! context they are given to be current, which egui's paint callback sees to.
#![allow(
    unsafe_code,
    reason = "every call of OpenGL is an unsafe function in glow; none is handed a pointer here"
)]

use eframe::glow::{self, HasContext as _};

use super::scene_buffers::{ROW, ROW_SHIFT};

/// What the GPU can do that we ask about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Abilities {
    embedded: bool,
    max_texture: i32,
    max_samples: i32,
    software: bool,
}

/// Parts of the names of renderers that draw on the processor.
const SOFTWARE: [&str; 6] =
    ["llvmpipe", "softpipe", "swiftshader", "software", "gdi generic", "basic render"];

impl Abilities {
    /// Those of the context, or why it will not do.
    pub(super) fn of(gl: &glow::Context) -> Result<Self, String> {
        let version = gl.version();
        let enough = if version.is_embedded { (3, 0) } else { (3, 3) };
        if (version.major, version.minor) < enough {
            return Err(format!(
                "This graphics driver offers OpenGL{} {}.{}; the view needs {}.{} at least.",
                if version.is_embedded { " ES" } else { "" },
                version.major,
                version.minor,
                enough.0,
                enough.1
            ));
        }
        // SAFETY: queries of state that GL 3.0 and ES 3.0 have.
        let (max_texture, max_samples, name) = unsafe {
            let [texture, samples] =
                [glow::MAX_TEXTURE_SIZE, glow::MAX_SAMPLES].map(|what| gl.get_parameter_i32(what));
            (texture, samples, gl.get_parameter_string(glow::RENDERER).to_lowercase())
        };
        let software = SOFTWARE.iter().any(|part| name.contains(part));
        Ok(Self { embedded: version.is_embedded, max_texture, max_samples, software })
    }

    /// Whether the processor draws, for want of a graphics card.
    pub(super) fn is_software(&self) -> bool {
        self.software
    }

    /// The longest side of a picture.
    pub(super) fn max_side(&self) -> i32 {
        self.max_texture
    }
}

/// A vertex and a fragment shader, linked.
#[derive(Debug)]
pub(super) struct Program(glow::Program);

impl Program {
    pub(super) fn new(
        gl: &glow::Context,
        abilities: &Abilities,
        definitions: &str,
        [vertex, fragment]: [&str; 2],
    ) -> Result<Self, String> {
        let version = if abilities.embedded { "#version 300 es" } else { "#version 330 core" };
        // ES has no default precision for floats in fragment shaders, and too little by default for integers.
        let head = format!(
            "{version}\nprecision highp float;\nprecision highp int;\n#define ROW_SHIFT {ROW_SHIFT}u\n\
             #define ROW_MASK {}u\n{definitions}\n",
            ROW - 1
        );
        let stages = [(glow::VERTEX_SHADER, vertex), (glow::FRAGMENT_SHADER, fragment)];
        // SAFETY: plain creation and linking; what was made is deleted again on every way out.
        unsafe {
            let program = gl.create_program()?;
            let mut shaders = Vec::new();
            let mut failed = None;
            for (kind, source) in stages {
                match gl.create_shader(kind) {
                    Ok(shader) => {
                        gl.shader_source(shader, &format!("{head}{source}"));
                        gl.compile_shader(shader);
                        if !gl.get_shader_compile_status(shader) {
                            failed = Some(gl.get_shader_info_log(shader));
                        }
                        gl.attach_shader(program, shader);
                        shaders.push(shader);
                    }
                    Err(message) => failed = Some(message),
                }
            }
            if failed.is_none() {
                gl.link_program(program);
                if !gl.get_program_link_status(program) {
                    failed = Some(gl.get_program_info_log(program));
                }
            }
            for shader in shaders {
                gl.detach_shader(program, shader);
                gl.delete_shader(shader);
            }
            match failed {
                None => Ok(Self(program)),
                Some(message) => {
                    gl.delete_program(program);
                    Err(format!("The graphics driver refuses a shader: {}", message.trim()))
                }
            }
        }
    }

    /// Use it, and hand out the means to set its uniforms.
    pub(super) fn bind<'a>(&self, gl: &'a glow::Context) -> Uniforms<'a> {
        // SAFETY: the program was linked by this context.
        unsafe { gl.use_program(Some(self.0)) };
        Uniforms { gl, program: self.0 }
    }

    pub(super) fn delete(self, gl: &glow::Context) {
        // SAFETY: made by this context, and used no more.
        unsafe { gl.delete_program(self.0) };
    }
}

/// The uniforms of the program in use. One that the compiler found no use for is passed over.
pub(super) struct Uniforms<'a> {
    gl: &'a glow::Context,
    program: glow::Program,
}

impl Uniforms<'_> {
    fn at(&self, name: &str) -> Option<glow::UniformLocation> {
        // SAFETY: the program is linked.
        unsafe { self.gl.get_uniform_location(self.program, name) }
    }

    pub(super) fn int(&self, name: &str, value: i32) -> &Self {
        // SAFETY: the program is in use; a wrong type is a GL error, not a fault. Likewise below.
        unsafe { self.gl.uniform_1_i32(self.at(name).as_ref(), value) };
        self
    }

    pub(super) fn uint(&self, name: &str, value: u32) -> &Self {
        // SAFETY: as above.
        unsafe { self.gl.uniform_1_u32(self.at(name).as_ref(), value) };
        self
    }

    pub(super) fn flag(&self, name: &str, value: bool) -> &Self {
        self.int(name, i32::from(value))
    }

    pub(super) fn float(&self, name: &str, value: f32) -> &Self {
        // SAFETY: as above.
        unsafe { self.gl.uniform_1_f32(self.at(name).as_ref(), value) };
        self
    }

    pub(super) fn pair(&self, name: &str, [x, y]: [f32; 2]) -> &Self {
        // SAFETY: as above.
        unsafe { self.gl.uniform_2_f32(self.at(name).as_ref(), x, y) };
        self
    }

    pub(super) fn int_pair(&self, name: &str, [x, y]: [i32; 2]) -> &Self {
        // SAFETY: as above.
        unsafe { self.gl.uniform_2_i32(self.at(name).as_ref(), x, y) };
        self
    }

    pub(super) fn triple(&self, name: &str, [x, y, z]: [f32; 3]) -> &Self {
        // SAFETY: as above.
        unsafe { self.gl.uniform_3_f32(self.at(name).as_ref(), x, y, z) };
        self
    }

    pub(super) fn matrix(&self, name: &str, columns: &[f32; 16]) -> &Self {
        // SAFETY: as above.
        unsafe { self.gl.uniform_matrix_4_f32_slice(self.at(name).as_ref(), false, columns) };
        self
    }
}

/// What a texel of a list is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TexelKind {
    /// Four floats.
    Float,
    /// Four unsigned integers.
    Uint,
}

/// A list of texels that a shader fetches by number, in rows of [`ROW`].
#[derive(Debug)]
pub(super) struct TexelList {
    texture: glow::Texture,
    kind: TexelKind,
    rows: i32,
}

impl TexelList {
    pub(super) fn new(gl: &glow::Context, kind: TexelKind) -> Result<Self, String> {
        // SAFETY: plain creation; lists are fetched, never filtered.
        unsafe {
            let texture = gl.create_texture()?;
            gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            for (parameter, value) in [
                (glow::TEXTURE_MIN_FILTER, glow::NEAREST),
                (glow::TEXTURE_MAG_FILTER, glow::NEAREST),
                (glow::TEXTURE_WRAP_S, glow::CLAMP_TO_EDGE),
                (glow::TEXTURE_WRAP_T, glow::CLAMP_TO_EDGE),
            ] {
                gl.tex_parameter_i32(glow::TEXTURE_2D, parameter, value as i32);
            }
            Ok(Self { texture, kind, rows: 0 })
        }
    }

    /// Put `texels` in; the texture is made anew only where their number of rows changed.
    pub(super) fn upload<T: bytemuck::Pod>(
        &mut self,
        gl: &glow::Context,
        abilities: &Abilities,
        texels: &[T],
    ) -> Result<(), String> {
        assert_eq!(size_of::<T>(), 16, "a texel is four times four bytes");
        let rows = texels.len().div_ceil(ROW).max(1);
        if rows > abilities.max_texture as usize {
            return Err(format!(
                "{} values are more than this graphics driver takes ({}).",
                texels.len(),
                abilities.max_texture as usize * ROW
            ));
        }
        let (internal, format, ty) = match self.kind {
            TexelKind::Float => (glow::RGBA32F, glow::RGBA, glow::FLOAT),
            TexelKind::Uint => (glow::RGBA32UI, glow::RGBA_INTEGER, glow::UNSIGNED_INT),
        };
        let rows = rows as i32;
        // SAFETY: whole rows of ROW texels of 16 bytes, as many as the slice has; the rest by itself.
        unsafe {
            gl.bind_texture(glow::TEXTURE_2D, Some(self.texture));
            gl.bind_buffer(glow::PIXEL_UNPACK_BUFFER, None);
            gl.pixel_store_i32(glow::UNPACK_ROW_LENGTH, 0);
            gl.pixel_store_i32(glow::UNPACK_ALIGNMENT, 4);
            if rows != self.rows {
                gl.tex_image_2d(
                    glow::TEXTURE_2D,
                    0,
                    internal as i32,
                    ROW as i32,
                    rows,
                    0,
                    format,
                    ty,
                    glow::PixelUnpackData::Slice(None),
                );
                self.rows = rows;
            }
            let whole = texels.len() / ROW;
            let (full, rest) = texels.split_at(whole * ROW);
            for (texels, row, width, height) in [(full, 0, ROW, whole), (rest, whole, rest.len(), 1)] {
                if !texels.is_empty() {
                    gl.tex_sub_image_2d(
                        glow::TEXTURE_2D,
                        0,
                        0,
                        row as i32,
                        width as i32,
                        height as i32,
                        format,
                        ty,
                        glow::PixelUnpackData::Slice(Some(bytemuck::cast_slice(texels))),
                    );
                }
            }
            gl.bind_texture(glow::TEXTURE_2D, None);
        }
        out_of_memory(gl, "the values of the surfaces")
    }

    /// Have the sampler of texture unit `unit` read it.
    pub(super) fn bind(&self, gl: &glow::Context, unit: u32) {
        // SAFETY: a texture of this context; ES 3.0 and GL 3.3 have 16 units at least.
        unsafe {
            gl.active_texture(glow::TEXTURE0 + unit);
            gl.bind_texture(glow::TEXTURE_2D, Some(self.texture));
        }
    }

    pub(super) fn delete(self, gl: &glow::Context) {
        // SAFETY: made by this context, and used no more.
        unsafe { gl.delete_texture(self.texture) };
    }
}

/// What an attribute of a vertex is made of: consecutive floats, then unsigned integers.
pub(super) type Attributes = &'static [(TexelKind, i32)];

/// Vertices of 16 bytes, with what tells a shader how to read them.
#[derive(Debug)]
pub(super) struct Vertices {
    array: glow::VertexArray,
    buffer: glow::Buffer,
    count: i32,
}

impl Vertices {
    pub(super) fn new<T: bytemuck::Pod>(
        gl: &glow::Context,
        vertices: &[T],
        attributes: Attributes,
    ) -> Result<Self, String> {
        assert_eq!(size_of::<T>(), 16, "a vertex is four times four bytes");
        let count =
            i32::try_from(vertices.len()).map_err(|_| "The scene has too many corners.".to_owned())?;
        // SAFETY: each attribute lies within the 16 bytes of a vertex.
        unsafe {
            let array = gl.create_vertex_array()?;
            let buffer = match gl.create_buffer() {
                Ok(buffer) => buffer,
                Err(message) => {
                    gl.delete_vertex_array(array);
                    return Err(message);
                }
            };
            gl.bind_vertex_array(Some(array));
            gl.bind_buffer(glow::ARRAY_BUFFER, Some(buffer));
            gl.buffer_data_u8_slice(glow::ARRAY_BUFFER, bytemuck::cast_slice(vertices), glow::STATIC_DRAW);
            let mut offset = 0;
            for (&(kind, size), location) in attributes.iter().zip(0..) {
                gl.enable_vertex_attrib_array(location);
                match kind {
                    TexelKind::Float => {
                        gl.vertex_attrib_pointer_f32(location, size, glow::FLOAT, false, 16, offset);
                    }
                    TexelKind::Uint => {
                        gl.vertex_attrib_pointer_i32(location, size, glow::UNSIGNED_INT, 16, offset);
                    }
                }
                offset += 4 * size;
            }
            gl.bind_vertex_array(None);
            gl.bind_buffer(glow::ARRAY_BUFFER, None);
            let made = Self { array, buffer, count };
            match out_of_memory(gl, "the scene's surfaces") {
                Ok(()) => Ok(made),
                Err(message) => {
                    made.delete(gl);
                    Err(message)
                }
            }
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Draw all of them, as triangles or lines.
    pub(super) fn draw(&self, gl: &glow::Context, mode: u32) {
        // SAFETY: the array was made by this context and holds `count` vertices.
        unsafe {
            gl.bind_vertex_array(Some(self.array));
            gl.draw_arrays(mode, 0, self.count);
            gl.bind_vertex_array(None);
        }
    }

    pub(super) fn delete(self, gl: &glow::Context) {
        // SAFETY: made by this context, and used no more.
        unsafe {
            gl.delete_vertex_array(self.array);
            gl.delete_buffer(self.buffer);
        }
    }
}

/// An error that says that memory ran out; any other is not ours to report, and is taken away.
fn out_of_memory(gl: &glow::Context, what: &str) -> Result<(), String> {
    // SAFETY: a query.
    match unsafe { gl.get_error() } {
        glow::OUT_OF_MEMORY => Err(format!("The graphics memory does not hold {what}.")),
        _ => Ok(()),
    }
}

/// A picture to draw to, with depth, several samples a pixel where they can be had, and afterwards a texture to read.
#[derive(Debug)]
pub(super) struct Target {
    size: [i32; 2],
    /// Holds light as it is; else it wants what a screen wants.
    linear: bool,
    /// Where it is drawn, and of what that consists.
    framebuffer: glow::Framebuffer,
    renderbuffers: Vec<glow::Renderbuffer>,
    /// Where it is read; the same one where there is one sample a pixel.
    resolved: Option<glow::Framebuffer>,
    texture: glow::Texture,
}

impl Target {
    /// A target of this size: the best of what the driver can do, or with one sample a pixel for a `draft`.
    pub(super) fn new(
        gl: &glow::Context,
        abilities: &Abilities,
        size: [i32; 2],
        draft: bool,
    ) -> Result<Self, String> {
        let many = if draft { 1 } else { abilities.max_samples.min(4) };
        // Half floats keep linear light to half a step of a screen's 255 and finer; what is averaged in a pixel is
        // light, as in the engine's pictures. ES 3.0 may not have them, and 8 bits must do, encoded.
        let choices = [(true, many), (false, many), (true, 1), (false, 1)];
        let mut last = String::new();
        for (linear, samples) in choices.into_iter().filter(|&(_, samples)| samples >= 1) {
            match Self::with(gl, size, linear, samples) {
                Ok(target) => return Ok(target),
                Err(message) => last = message,
            }
        }
        Err(last)
    }

    fn with(gl: &glow::Context, size: [i32; 2], linear: bool, samples: i32) -> Result<Self, String> {
        let [width, height] = size;
        let format = if linear { glow::RGBA16F } else { glow::RGBA8 };
        // SAFETY: plain creation; whatever was made is deleted where it is not complete.
        unsafe {
            let _ = gl.get_error();
            let texture = gl.create_texture()?;
            gl.bind_texture(glow::TEXTURE_2D, Some(texture));
            let ty = if linear { glow::HALF_FLOAT } else { glow::UNSIGNED_BYTE };
            gl.tex_image_2d(
                glow::TEXTURE_2D,
                0,
                format as i32,
                width,
                height,
                0,
                glow::RGBA,
                ty,
                glow::PixelUnpackData::Slice(None),
            );
            for parameter in [glow::TEXTURE_MIN_FILTER, glow::TEXTURE_MAG_FILTER] {
                gl.tex_parameter_i32(glow::TEXTURE_2D, parameter, glow::NEAREST as i32);
            }
            gl.bind_texture(glow::TEXTURE_2D, None);

            let mut renderbuffers = Vec::new();
            let mut renderbuffer = |format| -> Result<glow::Renderbuffer, String> {
                let made = gl.create_renderbuffer()?;
                renderbuffers.push(made);
                gl.bind_renderbuffer(glow::RENDERBUFFER, Some(made));
                if samples > 1 {
                    gl.renderbuffer_storage_multisample(glow::RENDERBUFFER, samples, format, width, height);
                } else {
                    gl.renderbuffer_storage(glow::RENDERBUFFER, format, width, height);
                }
                gl.bind_renderbuffer(glow::RENDERBUFFER, None);
                Ok(made)
            };
            let depth = renderbuffer(glow::DEPTH_COMPONENT24);
            let colour = if samples > 1 { renderbuffer(format).map(Some) } else { Ok(None) };

            let into_texture = |gl: &glow::Context| {
                let (colour, target) = (glow::COLOR_ATTACHMENT0, glow::FRAMEBUFFER);
                gl.framebuffer_texture_2d(target, colour, glow::TEXTURE_2D, Some(texture), 0);
            };
            let mut framebuffers = Vec::new();
            let mut complete = depth.is_ok() && colour.is_ok();
            if let (Ok(depth), Ok(colour)) = (depth, colour) {
                if let Ok(framebuffer) = gl.create_framebuffer() {
                    framebuffers.push(framebuffer);
                    gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
                    let attach = |place, buffer| {
                        gl.framebuffer_renderbuffer(
                            glow::FRAMEBUFFER,
                            place,
                            glow::RENDERBUFFER,
                            Some(buffer),
                        );
                    };
                    attach(glow::DEPTH_ATTACHMENT, depth);
                    match colour {
                        Some(colour) => attach(glow::COLOR_ATTACHMENT0, colour),
                        None => into_texture(gl),
                    }
                    complete &= gl.check_framebuffer_status(glow::FRAMEBUFFER) == glow::FRAMEBUFFER_COMPLETE;
                }
                if colour.is_some()
                    && let Ok(framebuffer) = gl.create_framebuffer()
                {
                    framebuffers.push(framebuffer);
                    gl.bind_framebuffer(glow::FRAMEBUFFER, Some(framebuffer));
                    into_texture(gl);
                    complete &= gl.check_framebuffer_status(glow::FRAMEBUFFER) == glow::FRAMEBUFFER_COMPLETE;
                }
                complete &= framebuffers.len() == if colour.is_some() { 2 } else { 1 };
            }
            complete &= gl.get_error() == glow::NO_ERROR;
            if complete {
                let resolved = framebuffers.get(1).copied();
                return Ok(Self {
                    size,
                    linear,
                    framebuffer: framebuffers[0],
                    renderbuffers,
                    resolved,
                    texture,
                });
            }
            framebuffers.into_iter().for_each(|made| gl.delete_framebuffer(made));
            renderbuffers.into_iter().for_each(|made| gl.delete_renderbuffer(made));
            gl.delete_texture(texture);
            Err(format!("The graphics driver offers no picture of {width} x {height} pixels with depth."))
        }
    }

    pub(super) fn size(&self) -> [i32; 2] {
        self.size
    }

    /// Whether it holds light as it is, rather than what a screen wants.
    pub(super) fn is_linear(&self) -> bool {
        self.linear
    }

    /// Whether a pixel has several samples.
    pub(super) fn is_multisampled(&self) -> bool {
        self.resolved.is_some()
    }

    /// Draw to it from now on.
    pub(super) fn bind(&self, gl: &glow::Context) {
        // SAFETY: a framebuffer of this context, found complete.
        unsafe { gl.bind_framebuffer(glow::FRAMEBUFFER, Some(self.framebuffer)) };
    }

    /// Make one of each pixel's samples.
    pub(super) fn resolve(&self, gl: &glow::Context) {
        let Some(resolved) = self.resolved else { return };
        let [width, height] = self.size;
        // SAFETY: both are complete, of one size and format.
        unsafe {
            gl.bind_framebuffer(glow::READ_FRAMEBUFFER, Some(self.framebuffer));
            gl.bind_framebuffer(glow::DRAW_FRAMEBUFFER, Some(resolved));
            let (mask, filter) = (glow::COLOR_BUFFER_BIT, glow::NEAREST);
            gl.blit_framebuffer(0, 0, width, height, 0, 0, width, height, mask, filter);
        }
    }

    /// Have the sampler of unit 0 read what was drawn.
    pub(super) fn bind_texture(&self, gl: &glow::Context) {
        // SAFETY: a texture of this context.
        unsafe {
            gl.active_texture(glow::TEXTURE0);
            gl.bind_texture(glow::TEXTURE_2D, Some(self.texture));
        }
    }

    pub(super) fn delete(self, gl: &glow::Context) {
        // SAFETY: made by this context, and used no more.
        unsafe {
            gl.delete_framebuffer(self.framebuffer);
            self.resolved.into_iter().for_each(|made| gl.delete_framebuffer(made));
            self.renderbuffers.into_iter().for_each(|made| gl.delete_renderbuffer(made));
            gl.delete_texture(self.texture);
        }
    }
}
