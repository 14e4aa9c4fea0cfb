/**
 * Materials that cost little where drawing is in software: nothing is computed per pixel but a colour between those of
 * the corners. Lights are three's, with the same result at the corners as of Lambert's material.
 */

import {
  type DataTexture,
  DoubleSide,
  GLSL3,
  NoBlending,
  RawShaderMaterial,
  ShaderMaterial,
  UniformsLib,
  UniformsUtils,
} from "three";

const PASSED_ON = `
    in vec3 shade;
    uniform float opacity;
    out vec4 colour;
    void main() { colour = vec4(shade, opacity); }`;

/** Surfaces of pieces whose poses and colours are in textures, lit at their corners; `pose` declares and reads them. */
export function litAtCorners(poses: DataTexture, tints: DataTexture, pose: string): ShaderMaterial {
  const uniforms = UniformsUtils.clone(UniformsLib.lights);
  return new ShaderMaterial({
    glslVersion: GLSL3,
    lights: true,
    uniforms: { ...uniforms, poses: { value: poses }, tints: { value: tints }, opacity: { value: 1 } },
    vertexShader: `
    #include <common>
    #include <lights_pars_begin>
    out vec3 shade;
    ${pose}
    void main() {
      ivec2 home = homeOf(piece);
      mat4 pose = poseAt(home);
      mat3 turn = mat3(pose);
      vec3 size = vec3(dot(turn[0], turn[0]), dot(turn[1], turn[1]), dot(turn[2], turn[2]));
      vec3 n = normalize(normalMatrix * (turn * (normal / size)));
      vec3 light = getHemisphereLightIrradiance(hemisphereLights[0], n)
        + directionalLights[0].color * saturate(dot(n, directionalLights[0].direction));
      vec3 linear = light * texelFetch(tints, home, 0).rgb * RECIPROCAL_PI;
      shade = 1.055 * pow(saturate(linear), vec3(1.0 / 2.4)) - 0.055;
      gl_Position = projectionMatrix * modelViewMatrix * (pose * vec4(position, 1.0));
    }`,
    fragmentShader: PASSED_ON,
  });
}

/** Colours of corners as they are given (sRGB), drawn over everything. */
export function unlit(): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    uniforms: { opacity: { value: 1 } },
    vertexShader: `
    uniform mat4 projectionMatrix;
    uniform mat4 modelViewMatrix;
    in vec3 position;
    in vec3 color;
    out vec3 shade;
    void main() {
      shade = color;
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    }`,
    fragmentShader: `precision mediump float;${PASSED_ON}`,
    depthTest: false,
    depthWrite: false,
    transparent: true, // drawn after what is not
    blending: NoBlending,
    side: DoubleSide,
  });
}
