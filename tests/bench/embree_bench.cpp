// Hard shadows by Intel's Embree, the ray tracer that a viewer of meshes would take: one ray a texel to
// the point light, whether anything is in the way. Not the length inside, so less than what the other
// rows answer. Triangles, two a cell, best tree, packets of 16 neighbours; the tree is built before.
#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <cmath>
#include <memory>

#include "core/base/angle.h"
#include "core/base/parallel.h"
#include "core/field/solid.h"
#include "tests/bench/terrain.h"

namespace relit::bench {
namespace {

constexpr double relief = 0.1;

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<RTCDeviceTy, Release>;
using Mesh = std::unique_ptr<RTCSceneTy, Release>;

// The texels of a solid as corners of triangles, in scene units.
Mesh mesh_of(const Solid& solid, RTCDevice device) {
    const unsigned width = unsigned(solid.width), height = unsigned(solid.height);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* corner = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), width * height));
    for (unsigned j = 0; j < height; ++j)
        for (unsigned i = 0; i < width; ++i) {
            const Vec3 p = surface_point(solid, int(i), int(j));
            *corner++ = float(p.x);
            *corner++ = float(p.y);
            *corner++ = float(p.z);
        }
    auto* index = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), 2 * (width - 1) * (height - 1)));
    for (unsigned j = 0; j + 1 < height; ++j)
        for (unsigned i = 0; i + 1 < width; ++i) {
            const unsigned a = j * width + i, b = a + width;
            for (const unsigned n : {a, b, a + 1, a + 1, b, b + 1}) *index++ = n;
        }
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    Mesh mesh(rtcNewScene(device));
    rtcSetSceneBuildQuality(mesh.get(), RTC_BUILD_QUALITY_HIGH);
    rtcAttachGeometry(mesh.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(mesh.get());
    return mesh;
}

// 16 texels of a row from i on: 1 where the light is seen, 0 in shadow.
void shade_packet(const Solid& solid, RTCScene mesh, Vec3 light, int i, int j, float* lit) {
    constexpr int lanes = 16;
    alignas(64) int valid[lanes];
    RTCRay16 rays;
    for (int k = 0; k < lanes; ++k) {
        const Vec3 from = surface_point(solid, i + k, j), way = light - from;
        valid[k] = -1;
        rays.org_x[k] = float(from.x);
        rays.org_y[k] = float(from.y);
        rays.org_z[k] = float(from.z);
        rays.dir_x[k] = float(way.x);
        rays.dir_y[k] = float(way.y);
        rays.dir_z[k] = float(way.z);
        rays.tnear[k] = 1e-4f;
        rays.tfar[k] = 1;
        rays.time[k] = 0;
        rays.mask[k] = ~0u;
        rays.id[k] = rays.flags[k] = 0;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcOccluded16(valid, mesh, &context, &rays);
    for (int k = 0; k < lanes; ++k) lit[k] = rays.tfar[k] < 0 ? 0.0f : 1.0f;
}

void embree_hard_shadow(benchmark::State& state) {
    const int size = int(state.range(0)), threads = int(state.range(2));
    const Solid solid = make_solid(terrain(size), relief, {}, 0);
    const Device device(rtcNewDevice("threads=1"));  // those of ours call it
    const Mesh mesh = mesh_of(solid, device.get());
    const Executor executor(threads);
    const Vec3 light{-0.05, 0.6, relief + 0.55 * std::tan(radians(double(state.range(1))))};
    Image lit(size, size, 1);
    for (auto _ : state)
        parallel_rows(executor, size, {}, [&](RowRange rows) {
            for (int j = rows.begin; j < rows.end; ++j)
                for (int i = 0; i + 16 <= size; i += 16)
                    shade_packet(solid, mesh.get(), light, i, j, &lit.row(j)[std::size_t(i)]);
        });
    double sum = 0;
    for (const float v : lit.values) sum += v;
    state.counters["lit"] = sum / double(lit.values.size());
}

BENCHMARK(embree_hard_shadow)
    ->ArgsProduct({{512, 1024, 2048}, {60, 30, 8}, {1, 2}})
    ->ArgNames({"size", "deg", "threads"})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace relit::bench
