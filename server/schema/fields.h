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
/// Numbers in the range, and the field must be there.
struct RequiredIn {
    Range range;
};
template <class Rule>
inline constexpr bool is_required = std::same_as<Rule, Required> || std::same_as<Rule, RequiredIn>;

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
constexpr auto choices_of<Model>() {
    return std::array{Choice{"integrated", Model::integrated}, Choice{"dipole", Model::dipole},
                      Choice{"better-dipole", Model::better_dipole},
                      Choice{"directional-dipole", Model::directional_dipole},
                      Choice{"normalised-diffusion", Model::normalised_diffusion}};
}
template <>
constexpr auto choices_of<scatter::DirectionalEnergy>() {
    return std::array{Choice{"published", scatter::DirectionalEnergy::published},
                      Choice{"matched", scatter::DirectionalEnergy::matched}};
}
template <>
constexpr auto choices_of<scatter::LobeKind>() {
    return std::array{Choice{"cosine", scatter::LobeKind::cosine},
                      Choice{"ward", scatter::LobeKind::ward},
                      Choice{"ashikhmin", scatter::LobeKind::ashikhmin},
                      Choice{"lafortune", scatter::LobeKind::lafortune}};
}
template <>
constexpr auto choices_of<HighlightTransport>() {
    return std::array{Choice{"local", HighlightTransport::local},
                      Choice{"subsurface", HighlightTransport::subsurface}};
}
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
    return std::array{Choice{"beauty", Layer::beauty},
                      Choice{"illumination", Layer::illumination},
                      Choice{"thickness", Layer::thickness},
                      Choice{"normal", Layer::normal},
                      Choice{"specular", Layer::specular},
                      Choice{"scatter", Layer::scatter},
                      Choice{"irradiance", Layer::irradiance},
                      Choice{"subsurface", Layer::subsurface},
                      Choice{"highlight", Layer::highlight},
                      Choice{"height", Layer::height},
                      Choice{"alpha", Layer::alpha}};
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

/// The rows of a medium that is given by its numbers; it may be given by a name as well.
template <class V, Like<scatter::Medium> M>
void medium_fields(V& v, M& medium) {
    v("sigmaA", medium.sigma_a, RequiredIn{from_to(0, 10000)},
      "Absorption coefficient per mm, of red, green and blue.");
    v("sigmaS", medium.sigma_s, RequiredIn{from_to(1e-6, 10000)},
      "Scattering coefficient per mm, of red, green and blue.");
    v("g", medium.g, from_to(-0.99, 0.99),
      "Mean cosine of the scattering angle: 0 = even, positive = forward.");
    v("eta", medium.eta, from_to(1, 3), "Refractive index beside the outside's.");
}

template <class V, Like<Film> F>
void fields(V& v, F& film) {
    v("medium", film.medium, Any{}, "What the film is made of: a measured medium, or its numbers.");
    v("thickness", film.thickness, above(0, 100), "mm.");
    v("g", film.g, RangeOrNull{from_to(-0.99, 0.99)},
      "Mean cosine of the scattering angle in place of the medium's; null: the medium's.");
}

template <class V, Like<Highlight> H>
void fields(V& v, H& highlight) {
    v("lobe", highlight.lobe, Any{},
      "Shape: a power of the cosine about the mirrored direction, or the lobes of Ward, "
      "Ashikhmin and Shirley, or Lafortune.");
    v("transport", highlight.transport, Any{},
      "local: light leaves where it enters; subsurface: it is carried below the surface, with "
      "exp(-extinction x distance).");
    v("k", highlight.k, from_to(0, 1000), "How much of it is added, times the light's colour.");
    v("nt", highlight.n_t, from_to(-1000, 10000),
      "Sharpness along the tangent; of lafortune the tangent's coefficient.");
    v("nb", highlight.n_b, from_to(-1000, 10000),
      "Sharpness along the bitangent; of lafortune the bitangent's coefficient.");
    v("exponent", highlight.exponent, from_to(0, 10000), "Of the lobes cosine and lafortune.");
}

template <class V, Like<Material> M>
void fields(V& v, M& m) {
    v("model", m.model, Any{},
      "How light becomes colour: the integrated model of one path, or subsurface scattering by a "
      "dipole (standard, better, directional) or by normalised diffusion.");
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
    v("medium", m.medium, Any{},
      "What the solid is made of, for the models of subsurface scattering: a measured medium "
      "(GET /v1/media), or its numbers.");
    v("mmPerWidth", m.mm_per_width, above(0, 1e6),
      "Width of the map in mm: a small thing is more translucent than a large one.");
    v("dirdipoleEnergy", m.directional_energy, Any{},
      "Of directional-dipole, which gives back more than the others and more than came in where "
      "the medium is bright: published leaves it so; matched gives back what better-dipole does "
      "of light that falls straight. Other models do not use it.");
    v("bssrdfWeight", m.bssrdf_weight, from_to(0, 1000), "Weight of subsurface scattering.");
    v("diffuseWeight", m.diffuse_weight, from_to(0, 1000),
      "Weight of matt reflection (Lambert) beside it.");
    v("film", m.film, Any{}, "Thin layer on the surface; null: none.");
    v("highlight", m.highlight, Any{}, "Highlights of the models of subsurface scattering.");
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
    v("bump", scene.bump, Any{},
      "Detail over the height map that shading alone shows, without shadows of its own: bright is "
      "near.");
    v("bumpRelief", scene.bump_relief, above(0, 10),
      "Height of white above black in the bump map, in image widths.");
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
