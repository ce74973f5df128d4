#include "server/config.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <set>
#include <stdexcept>

#include "server/routes/meta.h"

namespace relit::server {
namespace {

// OpenImageIO asks for 64 MB to read scanlines of any size.
constexpr std::size_t least_decode_memory = 128u << 20;

constexpr std::string_view variables_of_others[] = {"RELIT_API_KEY", "RELIT_DATA",
                                                    "RELIT_HTTPLIB_DIR"};

// Whether an address to listen on can be reached from this machine alone.
bool is_loopback(const std::string& host) {
    in_addr ipv4{};
    in6_addr ipv6{};
    if (::inet_pton(AF_INET, host.c_str(), &ipv4) == 1) return ntohl(ipv4.s_addr) >> 24 == 127;
    if (::inet_pton(AF_INET6, host.c_str(), &ipv6) == 1) return IN6_IS_ADDR_LOOPBACK(&ipv6);
    return host == "localhost";
}

std::filesystem::path default_data_dir() {
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::filesystem::path(value ? value : "");
    };
    if (const auto data = variable("XDG_DATA_HOME"); data.is_absolute()) return data / "relit";
    return variable("HOME") / ".local" / "share" / "relit";
}

// "--max-queue" is read from RELIT_MAX_QUEUE too.
std::string variable_of(const std::string& flag) {
    std::string name = "RELIT_";
    for (const char c : flag.substr(2)) name += c == '-' ? '_' : char(std::toupper(c));
    return name;
}

// A row of the settings.
template <typename Value>
CLI::Option* setting(CLI::App& app, const std::string& flag, Value& value,
                     const std::string& sentence) {
    return app.add_option(flag, value, sentence)->envname(variable_of(flag))->capture_default_str();
}

// In bytes, or with a unit.
CLI::Option* size_setting(CLI::App& app, const std::string& flag, std::size_t& value,
                          const std::string& sentence, std::size_t least = 1) {
    // Numbers beyond all arrive as the largest there is: the range catches them too.
    return setting(app, flag, value, sentence + ", in bytes or as 300MiB")
        ->transform(CLI::AsSizeValue(/*kb_is_1000=*/false))
        ->check(CLI::Range(least, std::size_t(1) << 60));
}

CLI::Option* time_setting(CLI::App& app, const std::string& flag, std::chrono::seconds& value,
                          const std::string& sentence, int longest = 86400) {
    return app
        .add_option_function<int>(
            flag, [&value](int seconds) { value = std::chrono::seconds(seconds); },
            sentence + ", in seconds")
        ->envname(variable_of(flag))
        ->default_str(std::to_string(value.count()))
        ->check(CLI::Range(1, longest));
}

void read_origins(const std::string& text, CorsPolicy& policy) {
    try {
        policy = parse_cors_policy(text);
    } catch (const std::invalid_argument& error) {
        throw CLI::ValidationError("--cors-origins", error.what());
    }
}

std::string simd_names() {
    std::string list;
    for (const Simd simd : available_simd())
        list.append(list.empty() ? "" : ", ").append(name_of(simd));
    return list;
}

Simd simd_of(const std::string& name) {
    for (const Simd simd : available_simd())
        if (name_of(simd) == name) return simd;
    throw CLI::ValidationError(
        "--simd", "'" + name + "' is none of what this processor has: " + simd_names());
}

void add_batch_settings(CLI::App& app, Limits& limits) {
    size_setting(app, "--max-batch-bytes", limits.max_batch_bytes, "The JSON of a batch");
    setting(app, "--max-batch-frames", limits.max_batch_frames, "Frames of a batch")
        ->check(CLI::Range(1, 1'000'000));
    setting(app, "--max-unfinished-batches", limits.max_unfinished_batches,
            "Batches that wait or run; more are refused with 503")
        ->check(CLI::Range(1, 1'000'000));
    setting(app, "--max-batch-renders", limits.max_batch_renders,
            "Frames of batches rendered at once, at most one per thread; 0: one for every thread")
        ->check(CLI::Range(0, 1024));
    setting(app, "--batch-share", limits.batch_share,
            "Percent of them, one at least, that go on while requests are rendered")
        ->check(CLI::Range(1, 100));
    size_setting(app, "--max-results", limits.max_result_bytes,
                 "Pictures of all batches together; those finished first go first");
    time_setting(app, "--batch-frame-timeout", limits.batch_frame_timeout,
                 "From the beginning of a frame to its picture");
    time_setting(app, "--batch-expiry", limits.batch_expiry,
                 "How long a finished batch and its pictures are kept", 10 * 365 * 86400);
}

void add_settings(CLI::App& app, Config& config) {
    Limits& limits = config.limits;
    const auto count = CLI::Range(1, 1'000'000);
    const auto pixels = CLI::Range(std::int64_t(1), std::int64_t(1) << 40);
    setting(app, "--host", config.host, "Address to listen on");
    setting(app, "--port", config.port, "Port to listen on; 0: any free one")
        ->check(CLI::Range(0, 65535));
    setting(app, "--data-dir", config.data_dir, "Folder of the stored images, made if missing");
    setting(app, "--threads", config.threads, "Threads that render; 0: one per processor")
        ->check(CLI::Range(0, 1024));
    app.add_option_function<std::string>(
           "--simd", [&config](const std::string& name) { config.simd = simd_of(name); },
           "Instructions to render with: " + simd_names() + "; pictures are the same with any")
        ->envname(variable_of("--simd"))
        ->default_str(std::string(name_of(config.simd)));
    setting(app, "--log-level", config.log_level, "How much to log")
        ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}));
    app.add_option_function<std::string>(
           "--log-format",
           [&config](const std::string& name) {
               config.log_format = name == "json" ? LogFormat::json : LogFormat::text;
           },
           "Lines of the log as text, or json: an object each")
        ->envname(variable_of("--log-format"))
        ->default_str("text")
        ->check(CLI::IsMember({"text", "json"}));
    app.add_option_function<int>(
           "--log-slow", [&config](int ms) { config.log_slow = std::chrono::milliseconds(ms); },
           "Warn of requests that take as long, in milliseconds; 0: never")
        ->envname(variable_of("--log-slow"))
        ->default_str("0")
        ->check(CLI::Range(0, 86'400'000));

    app.add_option_function<std::string>(
           "--cors-origins",
           [&config](const std::string& text) { read_origins(text, config.cors); },
           "Origins whose pages may read replies, with commas between; *: all; none: no other")
        ->envname(variable_of("--cors-origins"))
        ->default_str("*");

    setting(
        app, "--api-keys", config.api_keys,
        "File of the keys that clients need, a line each: key, read, render or admin, name; read "
        "again when it changes");
    app.add_flag("--insecure", config.insecure,
                 "Listen to other machines though there are no --api-keys")
        ->envname(variable_of("--insecure"))
        ->default_str("false");
    setting(
        app, "--rate-limit", limits.rate_limit,
        "Requests a second of a key, or of an address without keys; more are refused with 429; 0: "
        "any number")
        ->check(CLI::Range(0, 1'000'000));
    setting(app, "--rate-burst", limits.rate_burst, "Of those, at once after a pause")->check(count);

    setting(app, "--max-connections", limits.max_connections,
            "Connections at once, each with a thread; more wait")
        ->check(CLI::Range(1, 20'000));
    setting(app, "--max-waiting-connections", limits.max_waiting_connections,
            "Of those that wait; more are refused with 503")
        ->check(CLI::Range(1, 20'000));
    setting(
        app, "--max-address-connections", limits.max_address_connections,
        "Connections of one address, waiting ones too; more are refused with 429; 0: any number")
        ->check(CLI::Range(0, 100'000));
    setting(app, "--max-renders", limits.max_renders,
            "Renders at once, at most one per thread; 0: one for every two")
        ->check(CLI::Range(0, 1024));
    setting(app, "--max-queue", limits.max_queue,
            "Renders that may wait; more are refused with 503")
        ->check(CLI::Range(0, 1'000'000));
    setting(app, "--max-streams", limits.max_streams,
            "Event streams and archives at once, fewer than connections; 0: 80 % of those")
        ->check(CLI::Range(0, 20'000));
    add_batch_settings(app, limits);
    setting(app, "--max-decodes", limits.max_decodes, "Uploads decoded at once")
        ->check(CLI::Range(1, 1024));
    setting(app, "--decode-workers", limits.decode_workers,
            "Processes that decode the images of uploads, renders and batches")
        ->check(CLI::Range(1, 1024));
    size_setting(app, "--max-decode-memory", limits.max_decode_memory_bytes,
                 "Memory of each of them", least_decode_memory);

    size_setting(app, "--max-head-bytes", limits.max_head_bytes,
                 "Request line and headers together");
    size_setting(app, "--max-uri-bytes", limits.max_uri_bytes, "A request's target");
    setting(app, "--max-headers", limits.max_headers, "Headers of a request")->check(count);
    size_setting(app, "--max-body-bytes", limits.max_body_bytes, "A request's body");
    size_setting(app, "--max-image-bytes", limits.max_image_bytes, "An uploaded image");
    size_setting(app, "--max-body-memory", limits.max_body_memory_bytes,
                 "All bodies under way together");
    setting(app, "--max-parts", limits.max_parts, "Parts of a form")->check(count);
    size_setting(app, "--max-part-head-bytes", limits.max_part_head_bytes,
                 "Headers of each of them");
    size_setting(app, "--max-storage", limits.max_storage_bytes,
                 "All stored images together; the least recently used ones go first");
    size_setting(app, "--max-cache", limits.max_cache_bytes,
                 "Decoded maps kept for later requests; 0: none", 0);

    setting(app, "--max-image-pixels", limits.max_image_pixels, "Pixels of an image")->check(pixels);
    setting(app, "--max-interlaced-pixels", limits.max_interlaced_pixels,
            "Pixels of an interlaced or progressive image or a WebP")
        ->check(pixels);
    setting(app, "--max-image-side", limits.max_image_side, "Width and height of an image")
        ->check(CLI::Range(1, 32768));
    setting(app, "--max-image-channels", limits.max_image_channels, "Channels of an image")
        ->check(CLI::Range(1, 4));
    setting(app, "--max-image-values", limits.max_image_values, "Pixels times channels of an image")
        ->check(pixels);
    setting(app, "--max-tile-bytes", limits.max_tile_bytes, "A tile of an image, uncompressed")
        ->check(pixels);
    setting(app, "--max-environment-pixels", limits.max_environment_pixels,
            "Pixels of an environment")
        ->check(pixels);
    setting(app, "--max-output-pixels", limits.max_output_pixels, "Pixels of a rendered picture")
        ->check(pixels);
    setting(app, "--max-lights", limits.max_lights, "Lights of a scene")->check(count);
    setting(app, "--max-scene-cost", limits.max_scene_cost,
            "Texels times samples of light of a picture, some 45 ns of a thread each")
        ->check(CLI::Range(std::int64_t(1), std::int64_t(1) << 60));
    size_setting(app, "--max-render-memory", limits.max_render_memory_bytes,
                 "A picture's map and all that is made of it");
    setting(app, "--max-json-depth", limits.json.max_depth, "Levels of a scene's or batch's JSON")
        ->check(CLI::Range(8, 1000));
    setting(app, "--max-json-values", limits.json.max_values, "Values of a scene's or batch's JSON")
        ->check(CLI::Range(1000, 1'000'000'000));

    time_setting(app, "--idle-timeout", limits.idle_timeout, "How long a connection may be idle");
    time_setting(app, "--head-timeout", limits.head_timeout,
                 "How long a request's head may take to arrive");
    time_setting(app, "--read-timeout", limits.read_timeout, "Longest pause within a request");
    time_setting(app, "--write-timeout", limits.write_timeout, "Longest pause within a reply");
    size_setting(app, "--min-bytes-per-second", limits.min_bytes_per_second,
                 "Slowest transfer of a body or reply, after write-timeout");
    time_setting(app, "--transfer-timeout", limits.transfer_timeout,
                 "Longest time of a body, or of a reply, in all");
    time_setting(app, "--decode-timeout", limits.decode_timeout, "For decoding one image");
    time_setting(app, "--render-timeout", limits.render_timeout,
                 "From a request to its picture, queue included");
    time_setting(app, "--stop-timeout", limits.stop_timeout,
                 "For the requests under way when the server stops");
}

// @return the name of a RELIT_ variable that is nobody's
std::optional<std::string> unknown_variable(const CLI::App& app, const char* const* environment) {
    std::set<std::string, std::less<>> known(std::begin(variables_of_others),
                                             std::end(variables_of_others));
    for (const CLI::Option* option : app.get_options()) known.insert(option->get_envname());
    for (; *environment; ++environment) {
        const std::string_view entry = *environment;
        const auto name = entry.substr(0, entry.find('='));
        if (name.starts_with("RELIT_") && !known.contains(name)) return std::string(name);
    }
    return std::nullopt;
}

void list_settings(const CLI::App& app, Config& config) {
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_envname().empty()) continue;
        const auto value =
            option->count() > 0 ? option->results().front() : option->get_default_str();
        config.settings.emplace_back(option->get_single_name(), value);
    }
}

}  // namespace

ConfigOrExit read_config(int argc, const char* const* argv, const char* const* environment,
                         std::ostream& out, std::ostream& err) {
    ConfigOrExit result;
    result.config.data_dir = default_data_dir();
    CLI::App app("Relights height fields over HTTP.", "relitd");
    app.set_version_flag("--version", "relitd " + std::string(version()));
    app.get_formatter()->column_width(40);
    add_settings(app, result.config);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        result.exit_status = app.exit(error, out, err) == 0 ? 0 : 2;
        return result;
    }
    if (const auto name = unknown_variable(app, environment)) {
        err << "relitd: the environment variable " << *name
            << " is no setting; see relitd --help\n";
        result.exit_status = 2;
        return result;
    }
    list_settings(app, result.config);
    return result;
}

void check_batch_renders(const Limits& limits, int threads) {
    if (limits.max_batch_renders > threads)
        throw std::runtime_error("--max-batch-renders " + std::to_string(limits.max_batch_renders) +
                                 " is more than the " + std::to_string(threads) +
                                 " threads that render (--threads)");
}

std::string check_who_may_reach_it(const Config& config) {
    const bool has_keys = !config.api_keys.empty();
    if (has_keys && config.insecure)
        throw std::runtime_error("--api-keys and --insecure exclude each other");
    if (has_keys || is_loopback(config.host)) return {};
    if (config.insecure)
        return "INSECURE: no keys are asked for, and whoever reaches " + config.host +
               " may render, store and delete";
    throw std::runtime_error("--host " + config.host +
                             " lets other machines in: name the keys that they need with "
                             "--api-keys, or let everybody in with --insecure");
}

void check_streams(const Limits& limits) {
    if (limits.max_streams >= limits.max_connections)
        throw std::runtime_error("--max-streams " + std::to_string(limits.max_streams) +
                                 " leaves none of " + std::to_string(limits.max_connections) +
                                 " connections (--max-connections) for other requests");
}

int renders_at_once(const Config& config, int threads) {
    const int renders = config.limits.max_renders;
    if (renders > threads)
        throw std::runtime_error("--max-renders " + std::to_string(renders) + " is more than the " +
                                 std::to_string(threads) +
                                 " threads that render (--threads): every render works on one at "
                                 "least");
    return renders > 0 ? renders : std::max(1, threads / 2);
}

}  // namespace relit::server
