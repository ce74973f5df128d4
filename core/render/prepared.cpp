#include "core/render/prepared.h"

#include <cmath>

#include "core/base/key.h"
#include "core/field/normals.h"

namespace relit {
namespace {

// From the cache, or made for this caller alone where there is none or the map has no key.
template <class T, class Make>
std::shared_ptr<const T> shared(SharedCache* cache, const HeightField& field,
                                const std::string& key, const Make& make) {
    if (!cache || field.key.empty() || field.shape_key.empty()) return make().thing;
    return cache->get<T>(key, make);
}

std::uint64_t bytes_of(const Image& image) { return image.values.size() * sizeof(float); }

std::uint64_t bytes_of(const HeightField& field) {
    return bytes_of(field.heights) + bytes_of(field.bump) + bytes_of(field.alpha) +
           bytes_of(field.albedo) + field.no_height.size() / 8;
}

std::uint64_t bytes_of(const PreparedSolid& prepared) {
    return prepared.solid.bytes() + prepared.packets.bytes() + prepared.slopes.bytes() +
           prepared.bumped_slopes.bytes();
}

TransportSurface surface_of(const HeightField& field, const PreparedSolid& prepared,
                            const RenderControl& control) {
    const int width = field.width(), height = field.height();
    TransportSurface surface{Image(width, height, 1), Image(width, height, 1)};
    const double texel = 1.0 / width;
    parallel_rows(control.executor, height, control.stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < width; ++i) {
                surface.z.at(i, j) = prepared.solid.z.at(i + 1, j + 1);
                if (!field.is_solid(i, j)) continue;
                const Slopes at = prepared.slopes.at(field, i, j);
                surface.area.at(i, j) =
                    float(texel * texel * std::sqrt(1 + at.x * at.x + at.y * at.y));
            }
    });
    return surface;
}

}  // namespace

PreparedSolid::PreparedSolid(const Scene& scene, const RenderControl& control)
    : solid(make_solid(*scene.field, scene.relief, scene.base, scene.material.depth)),
      packets(solid, control.executor, control.simd),
      slopes(*scene.field, scene.relief, 0, control.executor),
      bumped_slopes(scene.field->bump.empty() ? MapSlopes()
                                              : MapSlopes(*scene.field, scene.relief,
                                                          scene.bump_relief, control.executor)),
      roughness(SkyTransfer::roughness(solid)) {}

std::shared_ptr<const PreparedSolid> prepared_solid(const Scene& scene,
                                                    const RenderControl& control) {
    const bool has_depth = scene.base.kind == Base::Kind::automatic;
    const std::string key =
        key_of("solid", scene.relief, int(scene.base.kind), scene.base.level,
               has_depth ? scene.material.depth : 0, int(control.simd),
               scene.field->bump.empty() ? 0 : scene.bump_relief, scene.field->shape_key);
    return shared<PreparedSolid>(control.cache, *scene.field, key, [&] {
        auto made = std::make_shared<const PreparedSolid>(scene, control);
        return SharedCache::Made<PreparedSolid>{made, bytes_of(*made)};
    });
}

std::shared_ptr<const NearestSolid> nearest_solid(const HeightField& field, SharedCache* cache) {
    return shared<NearestSolid>(cache, field, key_of("nearest-solid", field.shape_key), [&] {
        return SharedCache::Made<NearestSolid>{std::make_shared<const NearestSolid>(field),
                                               field.heights.texels() * sizeof(int)};
    });
}

std::shared_ptr<const HeightField> smaller_shared_field(const HeightField& field, int width,
                                                        int height, const RenderControl& control) {
    const std::string key = key_of("smaller", width, height, field.key);
    return shared<HeightField>(control.cache, field, key, [&] {
        auto small = std::make_shared<HeightField>(
            smaller_field(field, width, height, control.executor, control.stop));
        if (!field.key.empty()) {
            small->key = key;
            small->shape_key = key_of("smaller", width, height, field.shape_key);
        }
        const std::uint64_t bytes = bytes_of(*small);
        return SharedCache::Made<HeightField>{std::move(small), bytes};
    });
}

std::shared_ptr<const GatheredEnvironment> shared_environment_lights(const EnvironmentLight& light,
                                                                     EnvironmentSampling sampling,
                                                                     SharedCache* cache) {
    const auto make = [&] {
        auto made = std::make_shared<const GatheredEnvironment>(
            gathered_environment(*light.map, light.weighting, sampling));
        return SharedCache::Made<GatheredEnvironment>{made, made->bytes()};
    };
    if (!cache || light.map_key.empty()) return make().thing;
    return cache->get<GatheredEnvironment>(
        key_of("environment-lights", int(light.weighting), sampling.max_texels, sampling.regions,
               sampling.parts, light.map_key),
        make);
}

std::string medium_key(const Material& m) {
    std::string key = key_of(m.mm_per_width, m.medium.eta);
    for (int c = 0; c < 3; ++c)
        key += key_of(m.medium.sigma_a[c], m.medium.sigma_s[c], m.medium.g[c]);
    return key;
}

std::shared_ptr<const TransportSurface> prepared_surface(const Scene& scene,
                                                         const PreparedSolid& prepared,
                                                         const RenderControl& control) {
    const HeightField& field = *scene.field;
    const std::string key = key_of("surface", scene.relief, field.shape_key);
    return shared<TransportSurface>(control.cache, field, key, [&] {
        auto made = std::make_shared<TransportSurface>(surface_of(field, prepared, control));
        const std::uint64_t bytes = bytes_of(made->z) + bytes_of(made->area);
        return SharedCache::Made<TransportSurface>{std::move(made), bytes};
    });
}

std::shared_ptr<const Transport> prepared_transport(const Scene& scene,
                                                    std::shared_ptr<const TransportSurface> surface,
                                                    const CarryingKernel& kernel,
                                                    TransportAccuracy accuracy,
                                                    const RenderControl& control) {
    const HeightField& field = *scene.field;
    const std::string key = key_of("transport", kernel.name, int(accuracy), int(control.simd),
                                   scene.relief, field.shape_key);
    return shared<Transport>(control.cache, field, key, [&] {
        const RadialProfile profiles[] = {kernel.profile(0), kernel.profile(1), kernel.profile(2)};
        auto table =
            std::make_shared<const RadialKernel>(profiles, surface->spacing(), surface->extent());
        auto made = std::make_shared<const Transport>(surface, table, accuracy, control.executor,
                                                      control.stop, control.simd);
        const std::uint64_t bytes = made->bytes() + table->bytes();
        return SharedCache::Made<Transport>{std::move(made), bytes};
    });
}

std::shared_ptr<const DirectionalSum> prepared_directional_sum(const Scene& scene,
                                                               const PreparedSolid& prepared,
                                                               const TransportSurface& surface,
                                                               TransportAccuracy accuracy,
                                                               const RenderControl& control) {
    const Material& m = scene.material;
    const std::string key =
        key_of("directional-sum", medium_key(m), int(m.directional_energy), int(accuracy),
               int(control.simd), scene.relief, scene.field->bump.empty() ? 0 : scene.bump_relief,
               scene.field->shape_key);
    return shared<DirectionalSum>(control.cache, *scene.field, key, [&] {
        std::array<scatter::DirectionalDipole, 3> dipoles;
        for (int c = 0; c < 3; ++c)
            dipoles[c] =
                scatter::directional_dipole(scatter::channel(m.medium, c, m.mm_per_width),
                                            {.robust = true, .energy = m.directional_energy});
        auto made = std::make_shared<const DirectionalSum>(
            surface, prepared.slopes.image(*scene.field, control.executor),
            prepared.shading_slopes().image(*scene.field, control.executor), dipoles, accuracy,
            control.executor, control.stop, control.simd);
        const std::uint64_t bytes = made->bytes();
        return SharedCache::Made<DirectionalSum>{std::move(made), bytes};
    });
}

PreparedSky prepared_sky(const Scene& scene, const Solid& solid, Rect part, bool preview,
                         const RenderControl& control) {
    const HeightField& field = *scene.field;
    const Material& m = scene.material;
    const bool exponential = m.illumination == Illumination::exponential;
    const SkyRays rays{scene.relief, m.depth, m.offset == Offset::normal, exponential,
                       m.attenuation};
    const auto key = [&](SkyDirections directions) {
        return key_of("sky", directions.azimuths, directions.elevations, part.x, part.y, part.width,
                      part.height, scene.relief, int(scene.base.kind), scene.base.level, m.depth,
                      int(m.offset), exponential ? m.attenuation : -1, int(control.simd),
                      field.shape_key);
    };
    const bool may_be_kept = control.cache && !field.key.empty() && !field.shape_key.empty();
    if (preview && may_be_kept)
        if (auto there = control.cache->find<SkyTransfer>(key(final_sky))) return {there, false};
    const SkyDirections directions = preview ? preview_sky : final_sky;
    return {shared<SkyTransfer>(control.cache, field, key(directions),
                                [&] {
                                    auto made = std::make_shared<const SkyTransfer>(
                                        field, solid, rays, directions, part, control.executor,
                                        control.stop, control.simd);
                                    return SharedCache::Made<SkyTransfer>{made, made->bytes()};
                                }),
            preview};
}

}  // namespace relit
