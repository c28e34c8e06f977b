// Short lines from the patches' centres along their normals, bright at the foot.

layout(location = 0) in vec4 foot; // from the scene's centre; w is 0 at the foot, 1 at the tip

uniform mat4 clip_from_scene;

out float along;

void main() {
    along = foot.w;
    gl_Position = clip_from_scene * vec4(foot.xyz, 1.0);
}
