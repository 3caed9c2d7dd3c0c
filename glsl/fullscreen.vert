#version 460

// One triangle that covers the target; with LAYERS defined (include/layers.glsl), an instance of it for each of its layers.

#ifdef LAYERS
#extension GL_ARB_shader_viewport_layer_array : require
layout(location = 0) flat out int drawn_layer;
#endif

void main() {
    vec2 corner = vec2((gl_VertexIndex << 1) & 2, gl_VertexIndex & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
#ifdef LAYERS
    gl_Layer = gl_InstanceIndex;
    drawn_layer = gl_InstanceIndex;
#endif
}
