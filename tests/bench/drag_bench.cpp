// What a hand on the light sees: frames per second and latency through the real server, on loopback,
// and what parsing, queue, HTTP and socket add to rendering and encoding. Run:
// build/bench/tests/bench/relit_drag_bench [frames, 300]
//
// Map: fractal terrain (relief 0.1), uploaded as a 16-bit PNG. A light on a circle, a step further with
// each frame, one Relit-Session on one connection. Latency: from the first byte of the request sent
// to the last byte of the picture received.
#include <sys/types.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "core/io/encode.h"
#include "tests/bench/terrain.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"

namespace relit::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;
using test::HttpReply;

std::string upload(int port, const HeightField& field) {
    const std::string png = encode(field.heights, {.bit_depth = 16}, {Executor(2)});
    const HttpReply reply = test::http(port, "POST", "/v1/images", png);
    const std::size_t id = reply.body.find("\"id\":\"");
    if (reply.status / 100 != 2 || id == std::string::npos)
        throw std::runtime_error("upload: " + reply.body);
    return reply.body.substr(id + 6, 64);
}

struct Stream {
    std::string map;
    std::string format;
    std::string accuracy = "final";
    std::string session = "bench";
    std::string material = R"({"depth":0.004})";
};

// Light carried below the surface, and a highlight with it.
constexpr const char* translucent =
    R"({"depth":0.004,"model":"%s","medium":"marble","mmPerWidth":80,"highlight":{"k":0.3}})";

std::string frame(const Stream& stream, int number) {
    const double angle = number * 0.02;
    char scene[768];
    std::snprintf(scene, sizeof scene,
                  R"({"height":{"image":"%s"},"relief":0.1,"material":%s,)"
                  R"("light":{"type":"point","position":[%.4f,%.4f,0.5]},)"
                  R"("output":{"format":"%s","accuracy":"%s"}})",
                  stream.map.c_str(), stream.material.c_str(), 0.5 + 0.6 * std::cos(angle),
                  0.5 + 0.6 * std::sin(angle), stream.format.c_str(), stream.accuracy.c_str());
    return scene;
}

// A duration of the header Server-Timing, in milliseconds.
double timing(const HttpReply& reply, const std::string& stage) {
    const std::string header = reply.header("server-timing");
    const std::size_t at = header.find(stage + ";dur=");
    return at == std::string::npos ? 0 : std::atof(header.c_str() + at + stage.size() + 5);
}

struct Latencies {
    std::vector<double> ms;
    double work_ms = 0;  // render and encode, all frames together
    std::size_t bytes = 0;

    [[nodiscard]] double quantile(double share) {
        std::sort(ms.begin(), ms.end());
        return ms[std::min(ms.size() - 1, std::size_t(share * double(ms.size())))];
    }
    [[nodiscard]] double sum() const {
        double all = 0;
        for (const double one : ms) all += one;
        return all;
    }
};

Latencies drag(int port, const Stream& stream, int frames) {
    test::RawConnection connection(port);
    Latencies latencies;
    constexpr int warm_up = 5;
    for (int k = -warm_up; k < frames; ++k) {
        const std::string request = test::http_request("POST", "/v1/render", frame(stream, k),
                                                       {{"Relit-Session", stream.session}});
        const auto begin = Clock::now();
        connection.send(request);
        const HttpReply reply = connection.receive();
        const double took = Milliseconds(Clock::now() - begin).count();
        if (reply.status != 200) throw std::runtime_error("render: " + reply.body);
        if (k < 0) continue;
        latencies.ms.push_back(took);
        latencies.work_ms += timing(reply, "render") + timing(reply, "encode");
        latencies.bytes += reply.body.size();
    }
    return latencies;
}

void print_row(int size, const Stream& stream, Latencies l, const char* model) {
    const double p50 = l.quantile(0.5), p95 = l.quantile(0.95);
    std::printf("%6d %6s %9s %8.1f %8.2f %8.2f %8.2f %9.1f%% %9.1f %s\n", size,
                stream.format.c_str(), stream.accuracy.c_str(), 1e3 * double(l.ms.size()) / l.sum(),
                p50, p95, p95 / p50, 100 * (l.sum() / l.work_ms - 1),
                double(l.bytes) / 1e3 / double(l.ms.size()), model);
    std::fflush(stdout);
}

void one_stream(int port, int frames) {
    std::printf("%6s %6s %9s %8s %8s %8s %8s %10s %9s\n", "size", "format", "accuracy", "frames/s",
                "p50 ms", "p95 ms", "p95/p50", "overhead", "kB/frame");
    for (const int size : {512, 1024}) {
        const std::string map = upload(port, terrain(size));
        for (const char* format : {"png", "jpeg", "webp"})
            for (const char* accuracy : {"final", "preview"}) {
                const Stream stream{map, format, accuracy};
                print_row(size, stream, drag(port, stream, frames), "");
            }
        for (const char* model : {"dipole", "directional-dipole"})
            for (const std::string accuracy : {"final", "preview"}) {
                // Seconds a frame: not for dragging.
                if (model == std::string("directional-dipole") && accuracy == "final") continue;
                char material[256];
                std::snprintf(material, sizeof material, translucent, model);
                Stream stream{map, "jpeg", accuracy};
                stream.material = material;
                print_row(size, stream, drag(port, stream, frames / 3), model);
            }
    }
}

long resident_mib(pid_t pid) {
    std::ifstream status("/proc/" + std::to_string(pid) + "/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmRSS:")) return std::atol(line.c_str() + 6) / 1024;
    return 0;
}

// Eight people at once, each with a map of his own.
void eight_streams(const test::RelitProcess& server, int frames) {
    constexpr int streams = 8;
    std::vector<std::string> maps;
    for (int k = 0; k < streams; ++k) {
        HeightField field = terrain(512);
        field.heights.at(0, 0) = float(k) / streams;  // another map
        maps.push_back(upload(server.port(), field));
    }
    std::vector<Latencies> all(streams);
    {
        std::vector<std::jthread> people;
        for (int k = 0; k < streams; ++k)
            people.emplace_back([&, k] {
                all[k] = drag(server.port(), {maps[k], "jpeg", "final", std::to_string(k)}, frames);
            });
    }
    double worst = 0, least_rate = 1e9, most_rate = 0;
    for (Latencies& l : all) {
        worst = std::max(worst, l.quantile(1) / l.quantile(0.5));
        const double rate = 1e3 * double(l.ms.size()) / l.sum();
        least_rate = std::min(least_rate, rate);
        most_rate = std::max(most_rate, rate);
    }
    std::printf(
        "\n8 streams, 512, jpeg: %.1f to %.1f frames/s each; slowest frame over median, worst "
        "stream: %.2f; resident: %ld MiB\n",
        least_rate, most_rate, worst, resident_mib(server.pid()));
}

}  // namespace
}  // namespace relit::bench

int main(int argc, char** argv) {
    const int frames = argc > 1 ? std::atoi(argv[1]) : 300;
    if (frames < 1) {
        std::fprintf(stderr, "usage: relit_drag_bench [frames >= 1]\n");
        return 2;
    }
    const relit::test::RelitProcess server;
    relit::bench::one_stream(server.port(), frames);
    relit::bench::eight_streams(server, frames);
}
