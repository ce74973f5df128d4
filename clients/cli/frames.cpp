#include "clients/cli/frames.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>

#include "clients/cli/failure.h"
#include "clients/cli/limits_here.h"
#include "server/scenes/picture_etag.h"
#include "server/schema/batch_request.h"
#include "server/schema/client_json.h"
#include "server/schema/settings.h"

namespace relit::cli {
namespace {

namespace fs = std::filesystem;
using server::Setting;

constexpr std::uint64_t kept_bytes = 512u << 20;

// Pipes cannot be read again.
bool can_be_read_again(const Input& image) {
    std::error_code ignored;
    return !image.path.empty() && fs::is_regular_file(image.path, ignored);
}

void let_files_go(std::map<std::string, Input>& images) {
    for (auto& [id, image] : images)
        if (can_be_read_again(image)) image.bytes = {};
}

// --- Sweeps --------------------------------------------------------------------------------------

void add(const std::string& field, const std::string& value, std::vector<Setting>& settings) {
    if (!value.empty()) settings.push_back({"sweep." + field, value});
}

void add_path(const std::string& path, const std::string& count, std::vector<Setting>& settings) {
    if (count.empty()) return;
    add("path", path, settings);
    add("count", count, settings);
}

std::vector<Setting> settings_of(const SweepOptions& sweep) {
    std::vector<Setting> settings;
    add_path("orbit", sweep.orbit, settings);
    add_path("arc", sweep.arc, settings);
    add_path("line", sweep.line, settings);
    add_path("environment", sweep.turn, settings);
    if (settings.empty())
        throw Failure(Exit::usage, "sweep takes one of --orbit, --arc, --line and --turn");
    add("from", sweep.from, settings);
    add("to", sweep.to, settings);
    add("azimuth", sweep.azimuth, settings);
    add("elevation", sweep.elevation, settings);
    add("turns", sweep.turns, settings);
    add("easing", sweep.easing, settings);
    add("light", sweep.light, settings);
    if (sweep.returns) add("returns", "true", settings);
    return settings;
}

// --- Manifests -----------------------------------------------------------------------------------

// Adds a line's scene to `scenes`, and its images to `job`.
void read_line(const std::string& line, const fs::path& folder, bool with_server, SceneJob& job,
               std::vector<server::BatchFrame>& scenes) {
    server::BatchFrame frame = server::read_manifest_line(line);
    const std::size_t images = job.images.size();
    finish_scene_job(std::move(frame.scene), frame.name, folder, with_server, "output.format", job);
    if (job.images.size() > images) let_files_go(job.images);
    scenes.push_back({std::move(frame.name), job.text});
}

bool is_blank(const std::string& line) {
    return line.find_first_not_of(" \t\r") == std::string::npos;
}

std::vector<server::BatchFrame> read_lines(const Input& manifest, bool with_server, SceneJob& job) {
    std::vector<server::BatchFrame> scenes;
    std::string_view rest = manifest.bytes;
    for (int number = 1; !rest.empty(); ++number) {
        const auto end = std::min(rest.find('\n'), rest.size());
        const std::string line(rest.substr(0, end));
        rest.remove_prefix(std::min(end + 1, rest.size()));
        if (is_blank(line)) continue;
        const auto at = [&](const char* words) {
            return fmt::format("{}, line {}: {}", manifest.name, number, part_of_line(words));
        };
        try {
            read_line(line, manifest.path.parent_path(), with_server, job, scenes);
        } catch (const Error& e) {
            throw Failure(Exit::refused, at(e.what()));
        } catch (const Failure& e) {
            throw Failure(e.status, at(e.what()));
        }
    }
    if (scenes.empty()) throw Failure(Exit::refused, manifest.name + ": has no scenes");
    return scenes;
}

}  // namespace

// --- FrameImages ---------------------------------------------------------------------------------

FrameImages::FrameImages(std::map<std::string, Input> images)
    : images_(std::move(images)), kept_(kept_bytes) {}

Input FrameImages::get(const std::string& id) {
    const Input& known = images_.at(id);
    if (!std::string_view(known.bytes).empty()) return known;
    return *kept_.get<Input>(id, [&] {
        auto image = std::make_shared<const Input>(read_file(known.path));
        if (image->id != id) throw Failure(Exit::refused, known.name + ": has changed meanwhile");
        const std::uint64_t size = std::string_view(image->bytes).size();
        return SharedCache::Made<Input>{std::move(image), size};
    });
}

// --- Reading -------------------------------------------------------------------------------------

std::vector<Frame> frames_of(const std::string& request) {
    std::vector<std::vector<std::string>> images;
    const server::Limits limits = limits_here();
    const auto note = [&](const server::SceneDescription& scene) {
        auto& ids = images.emplace_back();
        server::for_each_image(
            scene, [&](const server::ImageSource& source) { ids.push_back(source.text); });
    };
    server::BatchRequest batch = server::parse_batch(
        request, {limits.max_lights, limits.max_batch_frames, limits.json}, note);
    std::vector<Frame> frames;
    for (std::size_t i = 0; i < batch.frames.size(); ++i) {
        server::BatchFrame& frame = batch.frames[i];
        std::string etag = server::picture_etag(frame.scene);
        frames.push_back(
            {std::move(frame.name), std::move(frame.scene), std::move(etag), std::move(images[i])});
    }
    return frames;
}

FrameJob read_sweep(const Options& options) {
    std::vector<Setting> request = settings_of(options.sweep);
    SceneJob job = read_scene_job(options.scene, "");
    request.push_back({"scene", job.text});
    let_files_go(job.images);
    return {frames_of(server::with_settings("{}", request)), std::move(job.images),
            std::move(job.files)};
}

FrameJob read_manifest(const Options& options) {
    const Input manifest =
        options.manifest == "-" ? read_input(options.manifest) : read_file(options.manifest);
    SceneJob job;
    if (!manifest.path.empty()) job.files.push_back(manifest.path);
    const auto scenes = read_lines(manifest, !options.scene.server.empty(), job);
    try {
        return {frames_of(server::scenes_request(scenes)), std::move(job.images),
                std::move(job.files)};
    } catch (const Error& e) {
        throw Failure(Exit::refused, manifest.name + ": " + part_of_line(e.what()));
    }
}

std::vector<Frame> frames_of_shard(std::vector<Frame> frames, const std::string& shard) {
    if (shard.empty()) return frames;
    std::size_t number = 0, count = 0;
    const char* const end = shard.data() + shard.size();
    const auto first = std::from_chars(shard.data(), end, number);
    const bool divided = first.ec == std::errc{} && first.ptr != end && *first.ptr == '/';
    const auto second = divided ? std::from_chars(first.ptr + 1, end, count) : first;
    if (!divided || second.ec != std::errc{} || second.ptr != end || number >= count)
        throw Failure(Exit::usage,
                      fmt::format("--shard: '{}' is not i/n, from 0/n to n-1/n", shard));
    std::vector<Frame> part;
    for (std::size_t i = number; i < frames.size(); i += count)
        part.push_back(std::move(frames[i]));
    return part;
}

}  // namespace relit::cli
