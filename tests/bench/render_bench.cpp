// Milliseconds per frame of one point light, beside what others do. Run:
// build/bench/tests/bench/relit_bench
//
// Maps: terrain (fractal, heights 0..1, relief 0.1), 512 to 2048 squared. Lights: at the map's
// edge, seen from its centre at 60,
// 30 and 8 degrees. Depth: 0.004 widths. Rows are named march/size/elevation/threads.
#include <benchmark/benchmark.h>

#include <cmath>

#include "core/base/angle.h"
#include "core/render/render.h"
#include "tests/bench/baselines.h"
#include "tests/bench/terrain.h"

namespace relit::bench {
namespace {

constexpr double relief = 0.1;
constexpr double depth = 0.004;

// At the map's left edge, so far up that its centre sees it under `elevation_deg`.
Vec3 light_at(double elevation_deg) {
    return {-0.05, 0.6, relief + 0.55 * std::tan(radians(elevation_deg))};
}

struct Setting {
    int size;
    double elevation_deg;
    int threads;
    explicit Setting(const benchmark::State& state)
        : size(int(state.range(0))),
          elevation_deg(double(state.range(1))),
          threads(int(state.range(2))) {}
};

template <class March>
void run_baseline(benchmark::State& state, const March& march) {
    const Setting setting(state);
    const Solid solid = make_solid(terrain(setting.size), relief, {}, depth);
    const Executor executor(setting.threads);
    Image d(setting.size, setting.size, 1);
    for (auto _ : state) march(solid, light_at(setting.elevation_deg), executor, d);
}

void thesis_100_steps(benchmark::State& state) {
    run_baseline(state, [](const Solid& solid, Vec3 light, const Executor& executor, Image& d) {
        march_thesis(solid, light, depth, 100, executor, d);
    });
}

void bilinear_per_texel(benchmark::State& state) {
    run_baseline(state, [](const Solid& solid, Vec3 light, const Executor& executor, Image& d) {
        march_per_texel(solid, light, depth, false, executor, d);
    });
}

void bilinear_per_texel_stopped(benchmark::State& state) {
    run_baseline(state, [](const Solid& solid, Vec3 light, const Executor& executor, Image& d) {
        march_per_texel(solid, light, depth, true, executor, d);
    });
}

Scene bench_scene(const Setting& setting) {
    Scene scene;
    scene.field = terrain(setting.size);
    scene.relief = relief;
    scene.material.depth = depth;
    PointLight light;
    light.position = light_at(setting.elevation_deg);
    scene.lights = {light};
    return scene;
}

void run_render(benchmark::State& state, Layer layer) {
    const Setting setting(state);
    const Scene scene = bench_scene(setting);
    const Executor executor(setting.threads);
    for (auto _ : state) benchmark::DoNotOptimize(render(scene, {.layer = layer}, {executor}));
}

void relit_illumination(benchmark::State& state) { run_render(state, Layer::illumination); }
void relit_picture(benchmark::State& state) { run_render(state, Layer::beauty); }

void settings(benchmark::internal::Benchmark* bench) {
    bench->ArgsProduct({{512, 1024, 2048}, {60, 30, 8}, {1, 2}})
        ->ArgNames({"size", "deg", "threads"})
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
}

BENCHMARK(thesis_100_steps)->Apply(settings);
BENCHMARK(bilinear_per_texel)->Apply(settings);
BENCHMARK(bilinear_per_texel_stopped)->Apply(settings);
BENCHMARK(relit_illumination)->Apply(settings);
BENCHMARK(relit_picture)->Apply(settings);

}  // namespace
}  // namespace relit::bench

BENCHMARK_MAIN();
