// A vertex is a corner of a facet; everything else about the facet is fetched by its number.

layout(location = 0) in vec3 position; // from the scene's centre
layout(location = 1) in uint mark;     // facet * 4 + corner

uniform mat4 clip_from_scene;
uniform highp usampler2D facets;

flat out uvec4 facet;
out vec2 uv;
out vec3 place;

void main() {
    uint number = mark >> 2;
    uint corner = mark & 3u;
    facet = texelFetch(facets, ivec2(number & ROW_MASK, number >> ROW_SHIFT), 0);
    // Corners run (0,0), (1,0), (1,1), (0,1).
    uv = vec2(corner == 1u || corner == 2u ? 1.0 : 0.0, corner >= 2u ? 1.0 : 0.0);
    place = position;
    gl_Position = clip_from_scene * vec4(position, 1.0);
}
