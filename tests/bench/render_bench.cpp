// Milliseconds per frame of one point light, beside what others do. Run:
// build/bench/tests/bench/relit_bench
//
// Maps: terrain (fractal, heights 0..1, relief 0.1), 512 to 2048 squared, and rough noise. Lights:
// at the map's edge, seen from its centre at 60, 30 and 8 degrees. Depth: 0.004 widths, offset along
// the view but for relit_illumination and relit_picture, which take normals as scenes do. Rows are
// named march/size/elevation/threads.
//
// Beside the speed stands what the picture's d is worth: against the exact march of 5000 random
// texels, PSNR, mean, 99.9 % and maximum of the difference.
#include <benchmark/benchmark.h>

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <stop_token>
#include <thread>

#include "core/base/angle.h"
#include "core/base/error.h"
#include "core/field/normals.h"
#include "core/render/render.h"
#include "core/shade/factors.h"
#include "core/visibility/inside_length.h"
#include "core/visibility/inside_lengths.h"
#include "tests/bench/baselines.h"
#include "tests/bench/terrain.h"
#include "tests/support/maps.h"

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

const HeightField& rough(int size) {
    static std::map<int, HeightField> made;
    const auto [place, is_new] = made.try_emplace(size);
    if (is_new) {
        test::Random random(1);
        place->second = test::field_of(size, size, [&](int, int) { return random(); });
    }
    return place->second;
}

Vec3 start_of(const Solid& solid, const HeightField& field, Offset offset, int i, int j) {
    const Vec3 inward =
        offset == Offset::normal ? normal_from(slopes_at(field, relief, i, j)) : Vec3{0, 0, 1};
    return surface_point(solid, i, j) - depth * inward;
}

// Puts the errors of a picture of d beside its speed.
void count_errors(benchmark::State& state, const HeightField& field, Vec3 light, Offset offset,
                  const Image& d) {
    constexpr int texels = 5000;
    const Solid solid = make_solid(field, relief, {}, depth);
    test::Random random(7);
    std::vector<double> errors;
    double sum = 0, squares = 0;
    for (int k = 0; k < texels; ++k) {
        const int i = int(random() * solid.width), j = int(random() * solid.height);
        const Vec3 from = start_of(solid, field, offset, i, j);
        const double r = inside_length(solid, ray_to_point(from, light));
        const double error = std::abs(d.at(i, j) - length_illumination(depth, r));
        errors.push_back(error);
        sum += error;
        squares += error * error;
    }
    std::sort(errors.begin(), errors.end());
    state.counters["PSNR_dB"] = -10 * std::log10(std::max(squares / texels, 1e-14));
    state.counters["mean"] = sum / texels;
    state.counters["p99.9"] = errors[texels - texels / 1000];
    state.counters["max"] = errors.back();
}

template <class March>
void run_baseline(benchmark::State& state, const March& march) {
    const Setting setting(state);
    const Solid solid = make_solid(terrain(setting.size), relief, {}, depth);
    const Executor executor(setting.threads);
    Image d(setting.size, setting.size, 1);
    const Vec3 light = light_at(setting.elevation_deg);
    for (auto _ : state) march(solid, light, executor, d);
    count_errors(state, terrain(setting.size), light, Offset::view, d);
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

// What r is defined by: cell by cell, in double.
void exact_per_texel(benchmark::State& state) {
    run_baseline(state, [](const Solid& solid, Vec3 light, const Executor& executor, Image& d) {
        parallel_rows(executor, solid.height, {}, [&](RowRange rows) {
            for (int j = rows.begin; j < rows.end; ++j)
                for (int i = 0; i < solid.width; ++i) {
                    const Vec3 from = surface_point(solid, i, j) - Vec3{0, 0, depth};
                    const double r = inside_length(solid, ray_to_point(from, light));
                    d.at(i, j) = float(length_illumination(depth, r));
                }
        });
    });
}

// Of a map that a cache knows again.
Scene scene_of(HeightField field, const Setting& setting) {
    Scene scene;
    field.key = field.shape_key = "map";
    scene.field = test::shared(std::move(field));
    scene.relief = relief;
    scene.material.depth = depth;
    PointLight light;
    light.position = light_at(setting.elevation_deg);
    scene.lights = {light};
    return scene;
}

struct Way {
    Offset offset = Offset::view;
    Simd simd = best_simd();
    bool is_cold = false;  // nothing is left of a render before
};

void run_illumination(benchmark::State& state, HeightField field, Way way) {
    const Setting setting(state);
    Scene scene = scene_of(std::move(field), setting);
    scene.material.offset = way.offset;
    const Executor executor(setting.threads);
    SharedCache cache(way.is_cold ? 0 : std::uint64_t(1) << 32);
    const Output output{.layer = Layer::illumination};
    const RenderControl control{.executor = executor, .simd = way.simd, .cache = &cache};
    Image d = render(scene, output, control).pixels;
    for (auto _ : state) d = render(scene, output, control).pixels;
    count_errors(state, *scene.field, light_at(setting.elevation_deg), way.offset, d);
}

const HeightField& terrain_of(const benchmark::State& state) {
    return terrain(Setting(state).size);
}

void relit_illumination(benchmark::State& state) { run_illumination(state, terrain_of(state), {}); }

void relit_normal_offset(benchmark::State& state) {
    run_illumination(state, terrain_of(state), {.offset = Offset::normal});
}

void relit_cold(benchmark::State& state) {
    run_illumination(state, terrain_of(state), {.is_cold = true});
}

void relit_rough(benchmark::State& state) {
    run_illumination(state, rough(Setting(state).size), {});
}

template <Simd simd>
void relit_with(benchmark::State& state) {
    const std::vector<Simd> available = available_simd();
    if (std::find(available.begin(), available.end(), simd) == available.end())
        return state.SkipWithError("this processor has no such instructions");
    run_illumination(state, terrain_of(state), {.simd = simd});
}

void relit_picture(benchmark::State& state) {
    const Setting setting(state);
    const Scene scene = scene_of(terrain_of(state), setting);
    const Executor executor(setting.threads);
    SharedCache cache(std::uint64_t(1) << 32);
    for (auto _ : state)
        benchmark::DoNotOptimize(render(scene, {}, {.executor = executor, .cache = &cache}));
}

double cpu_seconds() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

// Processor time of the whole program after a picture in the middle of its render was cancelled, as
// when a newer frame of a drag comes; with it what idle threads take until they sleep.
void relit_superseded(benchmark::State& state) {
    const Setting setting(state);
    const Scene scene = scene_of(terrain_of(state), setting);
    const Executor executor(setting.threads);
    SharedCache cache(std::uint64_t(1) << 32);
    const auto begun = std::chrono::steady_clock::now();
    for (int k = 0; k < 2; ++k)
        benchmark::DoNotOptimize(render(scene, {}, {.executor = executor, .cache = &cache}));
    const auto half = (std::chrono::steady_clock::now() - begun) / 8;  // the first one prepares
    double worst = 0;
    for (auto _ : state) {
        std::stop_source source;
        double stopped = 0;
        std::thread newer([&] {
            std::this_thread::sleep_for(half);
            stopped = cpu_seconds();
            source.request_stop();
        });
        try {
            const RenderControl control{
                .executor = executor, .stop = source.get_token(), .cache = &cache};
            benchmark::DoNotOptimize(render(scene, {}, control));
        } catch (const Error&) {  // cancelled
        }
        const double ended = cpu_seconds();
        newer.join();
        const double spent = source.stop_requested() ? std::max(0.0, ended - stopped) : 0.0;
        state.SetIterationTime(spent);
        worst = std::max(worst, spent);
    }
    state.counters["worst_ms"] = 1e3 * worst;
}

void settings(benchmark::internal::Benchmark* bench) {
    bench->ArgsProduct({{512, 1024, 2048}, {60, 30, 8}, {1, 2}})
        ->ArgNames({"size", "deg", "threads"})
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
}

BENCHMARK(thesis_100_steps)->Apply(settings);
BENCHMARK(bilinear_per_texel)->Apply(settings);
BENCHMARK(bilinear_per_texel_stopped)->Apply(settings);
BENCHMARK(exact_per_texel)->Apply(settings);
BENCHMARK(relit_with<Simd::portable>)->Apply(settings);
BENCHMARK(relit_with<Simd::avx2>)->Apply(settings);
BENCHMARK(relit_illumination)->Apply(settings);
BENCHMARK(relit_normal_offset)->Apply(settings);
BENCHMARK(relit_cold)->Apply(settings);
BENCHMARK(relit_rough)->Apply(settings);
BENCHMARK(relit_picture)->Apply(settings);
BENCHMARK(relit_superseded)
    ->ArgsProduct({{1024, 2048}, {30, 8}, {2}})
    ->ArgNames({"size", "deg", "threads"})
    ->Unit(benchmark::kMillisecond)
    ->Iterations(50)
    ->UseManualTime();

}  // namespace
}  // namespace relit::bench

BENCHMARK_MAIN();
