#include "core/render/prepared.h"

#include <sstream>

#include "core/field/normals.h"

namespace relit {
namespace {

// A key of the parts that make a thing what it is.
template <class... Parts>
std::string key_of(const Parts&... parts) {
    std::ostringstream key;
    key.imbue(std::locale::classic());
    key.precision(17);
    ((key << parts << ' '), ...);
    return key.str();
}

// From the cache, or made for this caller alone where there is none or the map has no key.
template <class T, class Make>
std::shared_ptr<const T> shared(SharedCache* cache, const HeightField& field,
                                const std::string& key, const Make& make) {
    if (!cache || field.key.empty() || field.shape_key.empty()) return make().thing;
    return cache->get<T>(key, make);
}

std::uint64_t bytes_of(const Image& image) { return image.values.size() * sizeof(float); }

std::uint64_t bytes_of(const HeightField& field) {
    return bytes_of(field.heights) + bytes_of(field.alpha) + bytes_of(field.albedo) +
           field.no_height.size() / 8;
}

std::uint64_t bytes_of(const PreparedSolid& prepared) {
    return prepared.solid.bytes() + prepared.packets.bytes() + bytes_of(prepared.slopes);
}

Image slopes_of(const HeightField& field, double relief, const Executor& executor) {
    Image slopes(field.width(), field.height(), 2);
    parallel_rows(executor, field.height(), {}, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < field.width(); ++i) {
                const Slopes at = slopes_at(field, relief, i, j);
                slopes.at(i, j, 0) = float(at.x);
                slopes.at(i, j, 1) = float(at.y);
            }
    });
    return slopes;
}

}  // namespace

PreparedSolid::PreparedSolid(const Scene& scene, const RenderControl& control)
    : solid(make_solid(*scene.field, scene.relief, scene.base, scene.material.depth)),
      packets(solid, control.executor, control.simd),
      slopes(slopes_of(*scene.field, scene.relief, control.executor)) {}

std::shared_ptr<const PreparedSolid> prepared_solid(const Scene& scene,
                                                    const RenderControl& control) {
    const bool has_depth = scene.base.kind == Base::Kind::automatic;
    const std::string key =
        key_of("solid", scene.relief, int(scene.base.kind), scene.base.level,
               has_depth ? scene.material.depth : 0, int(control.simd), scene.field->shape_key);
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

}  // namespace relit
