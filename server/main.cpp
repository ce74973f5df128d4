// relitd: the settings, the services and the transport put together; and how it stops.
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "core/base/error.h"
#include "core/base/standard_files.h"
#include "server/config.h"
#include "server/decoding/decode_helper.h"
#include "server/decoding/decode_pool.h"
#include "server/http/server.h"
#include "server/logging/log.h"
#include "server/routes/images.h"
#include "server/routes/routes.h"
#include "server/samples/samples.h"

extern char** environ;  // NOLINT: POSIX declares it nowhere

namespace relit::server {
namespace {

using Clock = std::chrono::steady_clock;

void begin_log(const Config& config) {
    start_log(config.log_format,
              spdlog::level::from_str(config.log_level == "error" ? "err" : config.log_level));
    std::vector<LogField> fields;
    for (const auto& [name, value] : config.settings) fields.push_back({name, value, "settings"});
    log_event(spdlog::level::info, "settings", fields);
}

// One descriptor per connection, and some for files.
void raise_descriptor_limit() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &limit);
}

// The C library gives threads up to eight heaps a processor, and each keeps what it took at its worst
// moment: connections have a thread each, but no more of them work at once than there are processors.
void limit_heaps() {
    const int processors = int(std::thread::hardware_concurrency());
    ::mallopt(M_ARENA_MAX, std::max(2, processors));
}

// Signals come as data to the main thread. Before the first thread is made: all inherit this.
int block_stop_signals() {
    sigset_t signals;
    ::sigemptyset(&signals);
    ::sigaddset(&signals, SIGINT);
    ::sigaddset(&signals, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    return ::signalfd(-1, &signals, SFD_CLOEXEC);
}

enum class Event { signal, finished, timeout };

Event wait_for_event(int signals, int finished, std::optional<Clock::time_point> deadline) {
    pollfd waiting[2] = {{.fd = signals, .events = POLLIN, .revents = 0},
                         {.fd = finished, .events = POLLIN, .revents = 0}};
    for (;;) {
        int timeout_ms = -1;
        if (deadline) {
            const auto left =
                std::chrono::ceil<std::chrono::milliseconds>(*deadline - Clock::now());
            timeout_ms = int(std::max<long long>(0, left.count()));
        }
        const int ready = ::poll(waiting, 2, timeout_ms);
        if (ready < 0) continue;
        if (waiting[1].revents != 0) return Event::finished;
        if (ready == 0) return Event::timeout;
        signalfd_siginfo info{};
        if (::read(signals, &info, sizeof info) == ssize_t(sizeof info)) return Event::signal;
    }
}

[[noreturn]] void exit_at_once(int status) {
    spdlog::default_logger()->flush();
    std::_Exit(status);  // threads are still at work; what is stored is whole at any moment
}

// Until the requests under way are finished; meanwhile probes hear that the server is not ready.
Event drain(Server& server, int signals, int finished, Clock::time_point deadline) {
    constexpr auto pause = std::chrono::milliseconds(20);
    server.drain();
    auto event = Event::timeout;
    while (event == Event::timeout && server.requests_under_way() > 0 && Clock::now() < deadline)
        event = wait_for_event(signals, finished, std::min(deadline, Clock::now() + pause));
    return event;
}

// After the first signal: the requests under way get their time, then are cancelled, then cut off.
void stop_gracefully(Server& server, int signals, int finished, std::chrono::seconds stop_timeout) {
    spdlog::info("stopping: finishing the requests under way, at most {} s", stop_timeout.count());
    const auto deadline = Clock::now() + stop_timeout;
    auto event = drain(server, signals, finished, deadline);
    server.stop();
    if (event == Event::timeout) event = wait_for_event(signals, finished, deadline);
    if (event == Event::timeout) {
        spdlog::warn("stopping: cancelling what is not finished");
        server.cancel();
        event = wait_for_event(signals, finished, Clock::now() + std::chrono::seconds(2));
    }
    if (event == Event::finished) return;
    spdlog::warn("stopping at once");
    server.cut();
    exit_at_once(event == Event::signal ? 1 : 0);
}

// @return the exit status
int serve_until_stopped(Server& server, Batches& batches, int signals, const Config& config) {
    const int finished = ::eventfd(0, EFD_CLOEXEC);
    bool failed = false;
    std::thread serving([&] {
        try {
            server.serve();
        } catch (const std::exception& error) {
            spdlog::critical("{}", error.what());
            failed = true;
        }
        ::eventfd_write(finished, 1);
    });
    if (wait_for_event(signals, finished, std::nullopt) == Event::signal) {
        batches.drain();
        stop_gracefully(server, signals, finished, config.limits.stop_timeout);
    }
    serving.join();
    batches.stop();
    ::close(finished);
    spdlog::info("stopped");
    return failed ? 1 : 0;
}

// Who is told that the server listens may send images: the helper is up, and can decode here. A sample
// that the limits refuse has been looked at by it too.
void check_decoding(DecodePool& pool) try {
    (void)pool.check(samples().front().bytes, {});
} catch (const relit::Error& error) {
    if (error.code != relit::error_code::image_too_large) throw;
    spdlog::warn("samples that are larger than --{} allows are refused as any image is: {}",
                 error.limit, error.what());
}

int run(const Config& config, int signals) {
    const Limits& limits = config.limits;
    const std::string warning = check_who_may_reach_it(config);
    Metrics metrics;
    DecodePool pool({.workers = limits.decode_workers,
                     .timeout = limits.decode_timeout,
                     .memory_bytes = limits.max_decode_memory_bytes,
                     .limits = decode_limits(limits)},
                    metrics);
    std::vector<BuiltIn> shipped;
    for (const Sample& sample : samples()) shipped.push_back({sample.id, sample.bytes});
    ImageStore images(config.data_dir,
                      {.read_info = [&](std::string_view bytes) { return pool.check(bytes, {}); },
                       .max_bytes = limits.max_storage_bytes,
                       .built_in = std::move(shipped)});
    check_streams(limits);
    Executor executor(config.threads);
    check_batch_renders(limits, executor.threads());
    RenderSlots renders({.max_running = renders_at_once(config, executor.threads()),
                         .max_waiting = limits.max_queue});
    RenderSlots decodes({.max_running = limits.max_decodes, .max_waiting = limits.max_queue});
    SharedCache cache(limits.max_cache_bytes);
    Batches batches(config.data_dir / "batches", {.images = images,
                                                  .decoder = pool.decoder(),
                                                  .cache = cache,
                                                  .renders = renders,
                                                  .metrics = metrics,
                                                  .limits = limits,
                                                  .threads = executor.threads(),
                                                  .simd = config.simd});
    Services services{images,
                      renders,
                      batches,
                      decodes,
                      executor,
                      cache,
                      metrics,
                      limits,
                      pool.decoder(),
                      config.cors,
                      config.data_dir,
                      config.simd,
                      {},
                      {},
                      Access({.api_keys = config.api_keys,
                              .rate_limit = limits.rate_limit,
                              .rate_burst = limits.rate_burst}),
                      config.log_slow};
    const Router router(routes(limits));
    Server server(router, services, limits);
    const int port = server.bind(config.host, config.port);
    check_decoding(pool);
    const bool is_ipv6 = config.host.find(':') != std::string::npos;
    std::printf("relitd listens on http://%s%s%s:%d\n", is_ipv6 ? "[" : "", config.host.c_str(),
                is_ipv6 ? "]" : "", port);
    std::fflush(stdout);
    if (!warning.empty()) spdlog::warn("{}", warning);
    batches.start();
    return serve_until_stopped(server, batches, signals, config);
}

}  // namespace
}  // namespace relit::server

int main(int argc, char** argv) {
    using namespace relit::server;
    relit::hold_standard_files();
    if (argc == 2 && std::string_view(argv[1]) == decode_helper_argument)
        return run_decode_helper();
    const auto [config, exit_status] = read_config(argc, argv, environ, std::cout, std::cerr);
    if (exit_status) return *exit_status;
    const int signals = block_stop_signals();
    raise_descriptor_limit();
    limit_heaps();
    try {
        begin_log(config);
        return run(config, signals);
    } catch (const std::exception& error) {
        std::cerr << "relitd: " << error.what() << '\n';
        return 1;
    }
}
