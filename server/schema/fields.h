// The field table of the interface: each field of a scene once, in a row of name, member, rule and
// sentence. Reading, writing, error pointers and the description of the interface all come from
// these rows. Source: api.md, "A scene".
//
// A row is a call of a visitor, v(name, member, rule, sentence); what is done with it is the
// visitor's business.
#pragma once

#include <array>
#include <concepts>
#include <limits>
#include <string_view>
#include <type_traits>

#include "server/schema/description.h"

namespace relit::server {

// Rules: what a member may hold beyond its type.

/// lo <= number <= hi, or lo < number where `lo_excluded`; for arrays every number of them.
struct Range {
    double lo = 0;
    double hi = 0;
    bool lo_excluded = false;
};
constexpr Range from_to(double lo, double hi) { return {lo, hi}; }
constexpr Range above(double lo, double hi) { return {lo, hi, true}; }

/// A number in the range, or null for none.
struct RangeOrNull {
    Range range;
};
/// A number in the range, or a word for none.
struct RangeOrWord {
    Range range;
    std::string_view word;
};
/// The type says it all.
struct Any {};
/// As Any, and the field must be there.
struct Required {};

template <class T>
struct Choice {
    std::string_view name;
    T value;
};
template <class T>
Choice(const char*, T) -> Choice<T>;

/// The words of an enumeration, the default's place not implied.
template <class T>
constexpr auto choices_of();

template <>
constexpr auto choices_of<Illumination>() {
    return std::array{Choice{"length", Illumination::length},
                      Choice{"exponential", Illumination::exponential},
                      Choice{"count", Illumination::count}};
}
template <>
constexpr auto choices_of<Offset>() {
    return std::array{Choice{"normal", Offset::normal}, Choice{"view", Offset::view}};
}
template <>
constexpr auto choices_of<Weighting>() {
    return std::array{Choice{"solid-angle", Weighting::solid_angle},
                      Choice{"uniform", Weighting::uniform}};
}
template <>
constexpr auto choices_of<PictureFormat>() {
    return std::array{Choice{"png", PictureFormat::png}, Choice{"jpeg", PictureFormat::jpeg},
                      Choice{"webp", PictureFormat::webp}, Choice{"exr", PictureFormat::exr}};
}
template <>
constexpr auto choices_of<Layer>() {
    return std::array{
        Choice{"beauty", Layer::beauty},       Choice{"illumination", Layer::illumination},
        Choice{"thickness", Layer::thickness}, Choice{"normal", Layer::normal},
        Choice{"specular", Layer::specular},   Choice{"scatter", Layer::scatter},
        Choice{"height", Layer::height},       Choice{"alpha", Layer::alpha}};
}
template <>
constexpr auto choices_of<Accuracy>() {
    return std::array{Choice{"final", Accuracy::final}, Choice{"preview", Accuracy::preview}};
}
template <>
constexpr auto choices_of<Effort>() {
    return std::array{Choice{"fast", Effort::fast}, Choice{"small", Effort::small}};
}
template <>
constexpr auto choices_of<Tone>() {
    return std::array{Choice{"clip", Tone::clip}, Choice{"filmic", Tone::filmic}};
}
template <>
constexpr auto choices_of<Transfer>() {
    return std::array{Choice{"srgb", Transfer::srgb}, Choice{"none", Transfer::none}};
}

// The struct, to read into or to write from.
template <class M, class T>
concept Like = std::same_as<std::remove_const_t<M>, T>;

constexpr Range anywhere = from_to(-1000, 1000);
constexpr Range intensities = from_to(0, 10000);
constexpr Range turns = from_to(-1e6, 1e6);
constexpr Range sizes = from_to(1, 32768);

template <class V, Like<PointLight> L>
void fields(V& v, L& light) {
    v("position", light.position, anywhere,
      "Where the light is: x and y as fractions of the map's width and height (0, 0 = bottom "
      "left), z in image widths "
      "towards the viewer, negative = behind.");
    v("color", light.colour, Any{}, "Colour of the light.");
    v("intensity", light.intensity, intensities, "Multiplies the colour.");
}

template <class V, Like<DirectionalLight> L>
void fields(V& v, L& light) {
    v("azimuth", light.azimuth_deg, turns,
      "Degrees clockwise from the top of the image, towards the light.");
    v("elevation", light.elevation_deg, from_to(-90, 90),
      "Degrees above the image plane; negative = from behind.");
    v("direction", light.direction, from_to(-1e300, 1e300),
      "Towards the light, any length but 0; in place of azimuth and elevation.");
    v("color", light.colour, Any{}, "Colour of the light.");
    v("intensity", light.intensity, intensities, "Multiplies the colour.");
}

template <class V, Like<EnvironmentDescription> L>
void fields(V& v, L& environment) {
    auto& light = environment.light;
    v("image", environment.image, Required{},
      "Equirectangular image, row 0 at the top; every texel is a light.");
    v("rotation", light.rotation, turns,
      "Degrees: yaw about the vertical (positive moves the image's centre right), then pitch "
      "(positive moves it down).");
    v("intensity", light.intensity, RangeOrWord{intensities, "auto"},
      "Multiplies the image; auto exposes any image well: 1.6 / its mean luminance over the "
      "sphere.");
    v("weighting", light.weighting, Any{},
      "What a texel weighs: the solid angle it covers, or the same as any other.");
    v("radius", light.radius, RangeOrNull{above(0, 1000)},
      "Radius of the sphere in image widths about the map's centre; null: infinitely far.");
}

template <class V, Like<Specular> S>
void fields(V& v, S& specular) {
    v("k", specular.k, from_to(0, 1), "Share of the highlight in the colour.");
    v("falloff", specular.falloff, from_to(-1, 1),
      "Cosines between mirrored view and light where the highlight begins and is full.");
    v("occlude", specular.occlude, Any{}, "Whether shadows darken highlights.");
}

template <class V, Like<Scatter> S>
void fields(V& v, S& scatter) {
    v("k", scatter.k, from_to(0, 1),
      "Share of forward scattering: how much only light from behind counts.");
    v("falloff", scatter.falloff, from_to(-1, 1),
      "Cosines between view and light's travel where forward scattering begins and is full.");
}

template <class V, Like<Material> M>
void fields(V& v, M& m) {
    v("baseColor", m.base_colour, Any{}, "Colour where no light arrives.");
    v("diffuseColor", m.diffuse_colour, Any{},
      "Colour of diffuse light; the albedo multiplies it.");
    v("specularColor", m.specular_colour, Any{}, "Colour of highlights.");
    v("depth", m.depth, above(0, 10),
      "How far under the surface light is gathered, in image widths: small is crisp, large is soft "
      "and translucent.");
    v("offset", m.offset, Any{},
      "Direction of that depth: along the surface normal, or along the view.");
    v("illumination", m.illumination, Any{},
      "What the light's path inside the solid does: length (depth / path), exponential "
      "(absorption), or count (the thesis's "
      "samples; needs a light at a finite distance).");
    v("attenuation", m.attenuation, above(0, 10000),
      "Absorption per image width, for exponential.");
    v("steps", m.steps, from_to(1, 10000), "Samples along the path, for count.");
    v("specular", m.specular, Any{}, "Highlights.");
    v("scatter", m.scatter, Any{}, "Forward scattering of light from behind.");
}

template <class V, Like<OutputDescription> O>
void fields(V& v, O& o) {
    v("format", o.format, Any{}, "File format of the picture.");
    v("layer", o.picture.layer, Any{},
      "The lit picture, or one of the quantities it is made of, as data.");
    v("accuracy", o.picture.accuracy, Any{},
      "final: always the same bytes; preview: may be coarser where that is faster.");
    v("width", o.picture.width, sizes,
      "Pixels; null keeps the map's, or the aspect if height is given.");
    v("height", o.picture.height, sizes,
      "Pixels; null keeps the map's, or the aspect if width is given.");
    v("region", o.picture.region, Any{},
      "Part of the map in texels [x, y, width, height], row 0 at the top; shadows come from the "
      "whole map.");
    v("bitDepth", o.bit_depth, from_to(8, 32),
      "Bits per number: png 8 or 16, jpeg and webp 8, exr 16 or 32; null = 8, exr 32.");
    v("quality", o.quality, from_to(1, 100), "Of jpeg and webp.");
    v("effort", o.effort, Any{}, "Whether the encoder aims at a fast answer or a small file.");
    v("exposure", o.picture.exposure, from_to(-20, 20), "Stops.");
    v("tone", o.picture.tone, Any{},
      "Tone curve: clip leaves numbers as they are, filmic rolls highlights off.");
    v("transfer", o.picture.transfer, Any{},
      "srgb: shading in linear light, sRGB files; none: every number is used and written as it "
      "is.");
    v("background", o.picture.background, Any{},
      "Colour under the picture; null keeps alpha (black in jpeg).");
}

template <class V, Like<SceneDescription> S>
void fields(V& v, S& scene) {
    v("height", scene.height, Required{}, "The height map: bright is near.");
    v("alpha", scene.alpha, Any{}, "Mask: what is below one half is not material.");
    v("albedo", scene.albedo, Any{}, "Colour per texel, multiplies diffuseColor.");
    v("relief", scene.relief, above(0, 10), "Height of white above black in image widths.");
    v("base", scene.base, from_to(-10, 10),
      "Floor of the material: none (endless opaque ground), auto (just under the lowest point), or "
      "a height in image widths: "
      "a panel with a back, through which light shines.");
    v("normalScale", scene.normal_scale, from_to(0, 100),
      "Exaggerates the slopes that highlights see.");
    v.lights("light", "lights", scene.lights, "One light, or several.");
    v("material", scene.material, Any{}, "What the solid is made of.");
    v("output", scene.output, Any{}, "What picture is wanted.");
}

/// The words of `type` of a light.
template <class L>
constexpr std::string_view light_type_name() {
    if constexpr (Like<L, PointLight>) return "point";
    else if constexpr (Like<L, DirectionalLight>) return "directional";
    else return "environment";
}

}  // namespace relit::server
