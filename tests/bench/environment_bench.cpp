// Milliseconds per frame under an environment of 512 x 256 texels: the first one of a relief, those
// after a rotation, and the PNG of the same picture.
//
// Rows are named what/size/sky/threads on fractal terrain (relief 0.1, depth 0.004), offset along
// the normal. Skies: 0 a sun and sky, 1 soft boxes, both made; 2 venice_sunset and 3
// studio_small_03, photographs, where RELIT_DATA has them. Beside the first frame stands what its
// colours are worth: root mean square and maximum of the difference from the full sum over all
// 131072 texels, each marched exactly, at 480 texels in random squares of 4 x 4.
//
// plain_sum is the baseline: 1024 directions, one bilinear step per texel of the way to the border,
// at 64 random texels; its time is scaled up to all texels of the map.
#include <benchmark/benchmark.h>

#include <array>

#include <chrono>
#include <map>
#include <numbers>
#include <optional>

#include "core/image/channels.h"
#include "core/io/decode.h"
#include "core/io/encode.h"
#include "core/render/render.h"
#include "core/render/shader.h"
#include "tests/bench/baselines.h"
#include "tests/bench/terrain.h"
#include "tests/support/data.h"
#include "tests/support/maps.h"
#include "tests/support/skies.h"

namespace relit::bench {
namespace {

constexpr double relief = 0.1;
constexpr double depth = 0.004;

std::shared_ptr<const Image> photograph(const char* name) {
    if (!test::has_data(name)) return nullptr;
    const DecodedImage file = decode(test::read_data(name));
    return std::make_shared<const Image>(rgb_channels(file.image, file.info.has_alpha));
}

std::shared_ptr<const Image> sky(int which) {
    static const std::shared_ptr<const Image> skies[] = {
        test::sun_and_sky(256), test::soft_boxes(256), photograph("env/venice_sunset.hdr"),
        photograph("env/studio_small_03.hdr")};
    return skies[which];
}

struct Setting {
    int size, sky, threads;
    explicit Setting(const benchmark::State& state)
        : size(int(state.range(0))), sky(int(state.range(1))), threads(int(state.range(2))) {}
};

// Nothing where the sky is not there.
std::optional<Scene> scene_of(const Setting& setting) {
    EnvironmentLight light;
    light.map = sky(setting.sky);
    if (!light.map) return {};
    light.map_key = "sky " + std::to_string(setting.sky);
    light.rotation = {40, 15};
    HeightField field = terrain(setting.size);
    field.key = field.shape_key = "terrain";
    Scene scene;
    scene.field = std::make_shared<const HeightField>(std::move(field));
    scene.relief = relief;
    scene.material.depth = depth;
    scene.lights = {light};
    return scene;
}

// Puts the errors of a scene's colours beside its speed.
void count_errors(benchmark::State& state, const Scene& scene) {
    constexpr int squares = 30;
    const Executor executor;
    const Image picture = render(scene, {.linear = true}, {executor}).pixels;
    const Shader full(scene, Transfer::srgb, {.max_texels = 1 << 20}, {executor});
    test::Random random(7);
    std::vector<TexelIndex> corners;
    for (int n = 0; n < squares; ++n)
        corners.push_back({int(random() * (picture.width - 4)) / 4 * 4,
                           int(random() * (picture.height - 4)) / 4 * 4});
    std::vector<double> sums(squares), most(squares);
    parallel_rows(executor, squares, {}, [&](RowRange rows) {
        for (int n = rows.begin; n < rows.end; ++n) {
            std::vector<TexelIndex> texels;
            for (int k = 0; k < 16; ++k)
                texels.push_back({corners[n].i + k % 4, corners[n].j + k / 4});
            std::array<float, std::size_t{3} * 16> expected;  // all reds, greens, blues
            full.beauty(texels, {}, expected);
            for (int k = 0; k < 16; ++k) {
                for (int c = 0; c < 3; ++c) {
                    const double e = picture.at(texels[k].i, texels[k].j, c) - expected[16 * c + k];
                    sums[n] += e * e / (3 * 16 * squares);
                    most[n] = std::max(most[n], std::abs(e));
                }
            }
        }
    });
    double sum = 0;
    for (const double s : sums) sum += s;
    state.counters["RMSE"] = std::sqrt(sum);
    state.counters["max"] = *std::max_element(most.begin(), most.end());
}

void environment_first_frame(benchmark::State& state) {
    const Setting setting(state);
    const auto scene = scene_of(setting);
    if (!scene) return state.SkipWithError("needs the test data (RELIT_DATA)");
    const Executor executor(setting.threads);
    for (auto _ : state) {
        SharedCache cache(1u << 30);
        benchmark::DoNotOptimize(render(*scene, {}, {executor, {}, {}, best_simd(), &cache}));
    }
    if (setting.size <= 512) count_errors(state, *scene);
}

void environment_rotation(benchmark::State& state) {
    const Setting setting(state);
    auto scene = scene_of(setting);
    if (!scene) return state.SkipWithError("needs the test data (RELIT_DATA)");
    const Executor executor(setting.threads);
    SharedCache cache(1u << 30);
    const RenderControl control{executor, {}, {}, best_simd(), &cache};
    (void)render(*scene, {}, control);
    for (auto _ : state) {
        std::get<EnvironmentLight>(scene->lights[0]).rotation.yaw_deg += 1;
        benchmark::DoNotOptimize(render(*scene, {}, control));
    }
}

void environment_png(benchmark::State& state) {
    const Setting setting(state);
    const auto scene = scene_of(setting);
    if (!scene) return state.SkipWithError("needs the test data (RELIT_DATA)");
    const Executor executor(setting.threads);
    const Image picture = render(*scene, {}, {executor}).pixels;
    for (auto _ : state)
        benchmark::DoNotOptimize(encode(picture, {.format = PictureFormat::png}, {executor}));
}

void environment_plain_sum(benchmark::State& state) {
    const int size = int(state.range(0));
    const Executor executor(int(state.range(1)));
    const Solid solid = make_solid(terrain(size), relief, {}, depth);
    constexpr int azimuths = 64, elevations = 16, texels = 64;
    std::vector<Vec3> directions;
    for (int a = 0; a < azimuths; ++a)
        for (int b = 0; b < elevations; ++b) {
            const double phi = 2 * std::numbers::pi * (a + 0.5) / azimuths;
            const double z = (b + 0.5) / elevations, flat = std::sqrt(1 - z * z);
            directions.push_back({flat * std::cos(phi), flat * std::sin(phi), z});
        }
    std::vector<float> d(texels);
    for (auto _ : state) {
        const auto begin = std::chrono::steady_clock::now();
        parallel_rows(executor, texels, {}, [&](RowRange rows) {
            for (int n = rows.begin; n < rows.end; ++n) {
                test::Random random(n);
                const int i = int(random() * size), j = int(random() * size);
                d[n] = march_sky_per_texel(solid, directions, depth, i, j);
            }
        });
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
        state.SetIterationTime(took.count() * size * size / texels);
    }
    benchmark::DoNotOptimize(d.data());
}

void settings(benchmark::internal::Benchmark* bench) {
    bench->ArgsProduct({{512, 1024}, {0, 1, 2, 3}, {1, 2}})
        ->ArgNames({"size", "sky", "threads"})
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
}

BENCHMARK(environment_plain_sum)
    ->ArgsProduct({{512, 1024}, {1, 2}})
    ->ArgNames({"size", "threads"})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1)
    ->UseManualTime();
BENCHMARK(environment_first_frame)->Apply(settings);
BENCHMARK(environment_rotation)->Apply(settings);
BENCHMARK(environment_png)->Apply(settings);

}  // namespace
}  // namespace relit::bench
