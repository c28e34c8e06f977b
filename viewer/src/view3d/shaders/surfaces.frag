// What radiosity::shade::ShadedSurfaces, ToneCurve and the back-face setting do, point by point, and what a window draws
// over it: edges, the chosen patch, warnings. Colours are in linear light until the picture is put on the screen.

// First patch; columns, or where a triangle's corners begin; rows; inner edges, or of a grid that others go on with where its
// values with a ring about them begin, and 1.
flat in uvec4 facet;
in vec2 uv;
in vec3 place;

// Compiled once for each combination that is wanted: a software renderer computes both sides of every branch.
//   GRIDS          facets are parallelograms cut into patches, else triangles
//   CONTENT_...    NONE, COLOUR or SCALAR       TONE_...  NEUTRAL, REINHARD or LINEAR
//   BACK_...       LIT, BLACK or MARKED         SMOOTH, LOGARITHMIC, HOLES, EDGES, WIREFRAME, SELECTED, ENCODE   as the words say

uniform highp sampler2D patch_values;  // colour, or a scalar in r; a is 1 where it is a number, 0 where it is not
uniform highp sampler2D corner_values; // the same at the corners of triangles, then those of grids that others go on with
uniform highp sampler2D colour_map;    // 256 colours in linear light

uniform float exposure;    // 2^EV
uniform vec2 range;        // of scalars; their logarithms where LOGARITHMIC
uniform vec3 wire_colour;
uniform float pixels_per_point;
uniform uint selected;     // a patch
uniform vec3 eye;          // from the scene's centre

out vec4 shown;

vec4 patch_value(uint number) {
    return texelFetch(patch_values, ivec2(number & ROW_MASK, number >> ROW_SHIFT), 0);
}

vec4 corner_value(uint number) {
    return texelFetch(corner_values, ivec2(number & ROW_MASK, number >> ROW_SHIFT), 0);
}

// The two cells whose centres `s` lies between, and the share of the second. Flat shading is the same with a step one
// pixel wide where they meet: an antialiased border.
void neighbours(float s, uint cells, float width, out uint before, out uint after, out float share) {
    float along = clamp(s * float(cells) - 0.5, 0.0, float(cells - 1u));
    before = uint(along);
    after = min(before + 1u, cells - 1u);
    share = along - float(before);
#ifndef SMOOTH
    share = clamp((share - 0.5) / clamp(width, 1e-6, 1.0) + 0.5, 0.0, 1.0);
#endif
}

#if defined(GRIDS) && defined(SMOOTH)
// The same where a ring of cells stands about them: always between two.
void ringed_neighbours(float s, uint cells, out uint before, out float share) {
    float along = clamp(s * float(cells) + 0.5, 0.0, float(cells) + 1.0);
    before = min(uint(along), cells);
    share = along - float(before);
}
#endif

// Values at the point; premultiplied by whether they are numbers.
vec4 value_here(vec2 cell_width) {
#ifdef GRIDS
#ifdef SMOOTH
    if (facet.w != 0u) {
        uint column, row;
        float along, upward;
        ringed_neighbours(uv.x, facet.y, column, along);
        ringed_neighbours(uv.y, facet.z, row, upward);
        uint at = facet.w - 1u + row * (facet.y + 2u) + column;
        uint over = at + facet.y + 2u;
        return mix(mix(corner_value(at), corner_value(at + 1u), along),
            mix(corner_value(over), corner_value(over + 1u), along), upward);
    }
#endif
    uint left, right, lower, upper;
    float s, t;
    neighbours(uv.x, facet.y, cell_width.x, left, right, s);
    neighbours(uv.y, facet.z, cell_width.y, lower, upper, t);
    uint low = facet.x + lower * facet.y;
    uint high = facet.x + upper * facet.y;
    vec4 below = mix(patch_value(low + left), patch_value(low + right), s);
    vec4 above = mix(patch_value(high + left), patch_value(high + right), s);
    return mix(below, above, t);
#elif defined(SMOOTH)
    vec2 at = max(uv, 0.0);
    at /= max(at.x + at.y, 1.0);
    return corner_value(facet.y) * (1.0 - at.x - at.y) + corner_value(facet.y + 1u) * at.x
        + corner_value(facet.y + 2u) * at.y;
#else
    return patch_value(facet.x);
#endif
}

vec3 neutral(vec3 colour) {
    float peak = max(colour.r, max(colour.g, colour.b));
    if (peak < 0.8) {
        return colour;
    }
    float d = 1.0 - 0.8;
    float new_peak = 1.0 - d * d / (peak + d - 0.8);
    float g = 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return new_peak + (colour * (new_peak / peak) - new_peak) * g;
}

vec3 reinhard(vec3 colour) {
    float luminance = dot(colour, vec3(0.2126, 0.7152, 0.0722));
    return colour * ((1.0 + luminance / 16.0) / (1.0 + luminance));
}

vec3 tone(vec3 colour) {
    colour = clamp(colour * exposure, 0.0, 1e9);
#if defined(TONE_NEUTRAL)
    colour = neutral(colour);
#elif defined(TONE_REINHARD)
    colour = reinhard(colour);
#endif
    return min(colour, 1.0);
}

vec3 false_colour(float value) {
#ifdef LOGARITHMIC
    float at = value > 0.0 ? log(value) : -1e30;
#else
    float at = value;
#endif
    float t = clamp((at - range.x) / (range.y - range.x), 0.0, 1.0);
    return texelFetch(colour_map, ivec2(int(t * 255.0 + 0.5), 0), 0).rgb;
}

// How much of the pixel a line `points` wide covers, `cells` from its middle, where a pixel is `width` cells; it fades
// where lines would stand closer than a few pixels, for then they say nothing and only darken.
float line(float cells, float width, float points) {
    float reach = max(points * pixels_per_point, 1.0) * 0.5;
    float apart = 1.0 / max(width, 1e-9);
    return clamp(reach + 0.5 - cells * apart, 0.0, 1.0) * smoothstep(2.0, 8.0, apart / pixels_per_point);
}

// The distance to the nearest whole number.
vec2 to_border(vec2 cells) {
    return abs(fract(cells - 0.5) - 0.5);
}

void main() {
    // Derivatives first, where no branch has parted neighbouring pixels.
    vec2 uv_x = dFdx(uv);
    vec2 uv_y = dFdy(uv);
    vec2 uv_width = sqrt(uv_x * uv_x + uv_y * uv_y);
#ifdef GRIDS
    vec2 counts = vec2(facet.yz);
#else
    vec2 counts = vec2(1.0);
#endif
    vec2 cell_width = uv_width * counts;

    // What has no light of its own to show is lit by a lamp at the eye, so that its shape is seen.
    vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
    float lamp = abs(dot(normal, normalize(eye - place)));

    vec3 colour;
#ifdef CONTENT_NONE
    colour = vec3(0.05 + 0.30 * lamp);
#else
    vec4 value = value_here(cell_width);
#ifdef HOLES
    value.rgb /= max(value.a, 1e-6);
#endif
#ifdef CONTENT_SCALAR
    colour = false_colour(value.r);
#else
    colour = tone(value.rgb);
#endif
#ifdef HOLES
    if (value.a < 0.5) {
        // No number: a grey hatch.
        float stripe = fract((gl_FragCoord.x + gl_FragCoord.y) / (10.0 * pixels_per_point));
        colour = vec3(stripe < 0.3 ? 0.6 : 1.0) * (0.03 + 0.15 * lamp);
    }
#endif
#endif

#if defined(BACK_BLACK)
    if (!gl_FrontFacing) {
        colour = vec3(0.0);
    }
#elif defined(BACK_MARKED)
    if (!gl_FrontFacing) {
        vec2 square = floor(gl_FragCoord.xy / (7.0 * pixels_per_point));
        colour = mod(square.x + square.y, 2.0) < 0.5 ? vec3(0.70, 0.0, 0.38) : vec3(0.14, 0.0, 0.08);
        colour *= 0.4 + 0.6 * lamp;
    }
#endif

    float coverage = 1.0;
#if defined(EDGES) || defined(WIREFRAME) || defined(SELECTED)
    // Distances to the borders of the patch (or, of a triangle, to its outer edges), and of the facet.
#ifdef GRIDS
    vec2 cells = uv * counts;
    vec2 away = to_border(cells);
    vec2 end = min(uv, 1.0 - uv);
    float border = max(line(away.x, cell_width.x, 1.0), line(away.y, cell_width.y, 1.0));
    border = max(border, max(line(end.x, uv_width.x, 1.0), line(end.y, uv_width.y, 1.0)));
    uvec2 cell = uvec2(clamp(cells, vec2(0.0), counts - 1.0));
    bool chosen = facet.x + cell.y * facet.y + cell.x == selected;
    vec2 pixels = away / max(cell_width, vec2(1e-9));
    float rim = min(pixels.x, pixels.y);
#else
    // The edges v = 0, u = 0 and u + v = 1.
    vec3 away = max(vec3(uv.y, uv.x, 1.0 - uv.x - uv.y), 0.0);
    vec3 width = max(vec3(uv_width.y, uv_width.x, length(vec2(uv_x.x + uv_x.y, uv_y.x + uv_y.y))), 1e-9);
    away += vec3(facet.w & 1u, (facet.w >> 1) & 1u, (facet.w >> 2) & 1u) * 1e9;
    float border =
        max(line(away.x, width.x, 1.0), max(line(away.y, width.y, 1.0), line(away.z, width.z, 1.0)));
    bool chosen = facet.x == selected;
    vec3 pixels = away / width;
    float rim = min(pixels.x, min(pixels.y, pixels.z));
#endif
#if defined(WIREFRAME)
    colour = gl_FrontFacing ? wire_colour : mix(wire_colour, vec3(0.5), 0.6);
    coverage = border;
#elif defined(EDGES)
    // Dark lines on what is bright, bluish ones on what is dark: an unlit scene shows its shape as well.
    colour = mix(colour, colour * 0.35 + vec3(0.024, 0.036, 0.060), border);
#endif
#ifdef SELECTED
    if (chosen) {
        float reach = 2.5 * pixels_per_point;
        float outline = clamp(reach + 0.5 - rim, 0.0, 1.0);
        float halo = clamp(reach + pixels_per_point + 0.5 - rim, 0.0, 1.0);
        colour = mix(colour, vec3(0.0), 0.7 * halo);
        colour = mix(colour, vec3(1.0, 0.35, 0.0), outline);
        coverage = max(coverage, halo);
    }
#endif
#endif
#ifdef WIREFRAME
    // Only here: what may be discarded cannot be skipped for being hidden.
    if (coverage < 0.02) {
        discard;
    }
#endif
#ifdef ENCODE
    colour = srgb(colour);
#endif
    shown = vec4(colour, coverage);
}
