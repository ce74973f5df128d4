// Lights: what a scene says of them, and the samples that a renderer sums over. One struct per kind
// of light and one function for all: samples_of(). Source: integrated model, sections 1, 5 and 6.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/vec.h"
#include "core/image/colour.h"
#include "core/image/image.h"

namespace relit {

struct PointLight {
    /// x and y as fractions of the map's width and height (0, 0 = bottom left), z in scene units,
    /// negative = behind.
    Vec3 position{0.1, 1.0, 0.6};
    Colour colour = hex_colour(255, 255, 255);
    double intensity = 1;
};

struct DirectionalLight {
    double azimuth_deg = 315;  ///< clockwise from the top of the image
    double elevation_deg = 35;
    std::optional<Vec3> direction;  ///< towards the light, any length but 0; counts before the angles
    Colour colour = hex_colour(255, 255, 255);
    double intensity = 1;
};

enum class Weighting {
    solid_angle,  ///< a texel weighs what it covers of the sphere
    uniform,      ///< every texel the same; the thesis's mean
};

/// About +y by yaw, then about +x by pitch, both right-handed: positive yaw moves an environment's
/// centre to the right, positive pitch moves it down.
struct Rotation {
    double yaw_deg = 0;
    double pitch_deg = 0;
};

struct EnvironmentLight {
    /// Equirectangular, 3 channels >= 0 and finite, numbers to shade with, row 0 at the top.
    std::shared_ptr<const Image> map;
    /// Names the map for a SharedCache, where what is made of it may be kept; empty: it is not.
    std::string map_key;
    Rotation rotation;
    std::optional<double> intensity;  ///< none: `auto`, 1.6 / mean luminance over the sphere
    Weighting weighting = Weighting::solid_angle;
    /// Of a sphere about the map's centre at z = 0, scene units; none: infinitely far.
    std::optional<double> radius;
};

using Light = std::variant<PointLight, DirectionalLight, EnvironmentLight>;

/// A part of a sample, for highlights, which see finer than shadows do.
struct SamplePart {
    Vec3 at;  ///< as LightSample::at
    Rgb radiance;
    double weight = 0;
};

/// One direction or position that light comes from: a whole point or directional light, a texel of
/// an environment, or a region of it.
struct LightSample {
    Vec3 at;                   ///< position in scene units, or unit direction towards the light
    bool at_infinity = false;  ///< `at` is a direction
    Rgb radiance;              ///< w I c: weight, intensity and colour multiplied
    double weight = 1;         ///< w; the weights of one light sum to 1
    std::vector<SamplePart> parts;  ///< of a region: they sum to it. Empty: it is its own only part
};

/// How a map's fractions become scene units: width 1, height `y_size`.
struct MapExtent {
    double y_size = 1;
};

/// How many samples stand for an environment.
struct EnvironmentSampling {
    int max_texels = 512;  ///< up to here one per texel: the full sum that the model defines
    int regions = 256;     ///< a larger map is gathered into this many, >= 1 (environment.h)
    int parts = 16;        ///< each of them has up to this many parts for highlights, >= 1
};

/// The samples of one light.
[[nodiscard]] std::vector<LightSample> samples_of(const Light& light, MapExtent extent,
                                                  Transfer transfer, EnvironmentSampling sampling);

}  // namespace relit
