#include "clients/cli/scene_job.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "clients/cli/failure.h"
#include "clients/cli/limits_here.h"
#include "server/error_codes.h"
#include "server/samples/samples.h"
#include "server/schema/base64.h"
#include "server/schema/field_error.h"
#include "server/schema/field_paths.h"
#include "server/schema/fields.h"
#include "server/schema/scene_json.h"
#include "server/schema/settings.h"
#include "server/storage/sha256.h"
#include "server/text.h"

namespace relit::cli {
namespace {

namespace fs = std::filesystem;
using server::ImageSource;
using server::Setting;

// --- Flags as settings ---------------------------------------------------------------------------

// Reads an image and keeps it. @return its id
std::string keep(Input input, SceneJob& job) {
    std::string id = input.id;
    if (!input.path.empty()) job.files.push_back(input.path);
    job.images.emplace(id, std::move(input));
    return id;
}

void add_image(const std::string& field, const std::string& argument,
               std::vector<Setting>& settings, SceneJob& job) {
    if (argument.empty()) return;
    const std::string id = keep(read_input(argument), job);
    settings.push_back({field, R"({"image":")" + id + R"("})"});
}

bool is_number(std::string_view text) {
    if (text.starts_with('+')) text.remove_prefix(1);
    return server::parse_number<double>(text).has_value();
}

// "file,yaw,pitch": up to two numbers at the end are angles; other commas are the file's own.
void add_environment(const std::string& argument, std::vector<Setting>& settings, SceneJob& job) {
    if (argument.empty()) return;
    std::size_t end = argument.size();
    for (int angle = 0; angle < 2; ++angle) {
        const auto comma = argument.rfind(',', end - 1);
        if (end == 0 || comma == std::string::npos || comma == 0) break;
        if (!is_number(std::string_view(argument).substr(comma + 1, end - comma - 1))) break;
        end = comma;
    }
    const std::string id = keep(read_input(argument.substr(0, end)), job);
    settings.push_back({"env", id + argument.substr(end)});
}

// "800x600", "800", "x600"; the other side keeps the aspect.
void add_size(const std::string& size, std::vector<Setting>& settings) {
    if (size.empty()) return;
    const auto is_count = [](std::string_view text) {
        return !text.empty() && text.size() <= 9 &&
               text.find_first_not_of("0123456789") == std::string_view::npos;
    };
    const auto x = size.find('x');
    const std::string width = size.substr(0, x);
    const std::string height = x == std::string::npos ? "" : size.substr(x + 1);
    const bool known = x == std::string::npos
                           ? is_count(width)
                           : (width.empty() || is_count(width)) && is_count(height);
    if (!known) throw Failure(Exit::usage, fmt::format("--size: '{}' is not WxH, W or xH", size));
    settings.push_back({"output.width", width.empty() ? "null" : width});
    settings.push_back({"output.height", height.empty() ? "null" : height});
}

void add_text(const std::string& field, const std::string& value, std::vector<Setting>& settings) {
    if (!value.empty()) settings.push_back({field, value});
}

std::vector<Setting> settings_of_flags(const SceneOptions& options, SceneJob& job) {
    std::vector<Setting> settings;
    add_text("preset", options.preset, settings);
    add_image("height", options.relief, settings, job);
    add_image("alpha", options.alpha, settings, job);
    add_image("albedo", options.albedo, settings, job);
    add_image("bump", options.bump, settings, job);
    add_text("light", options.light, settings);
    add_text("sun", options.sun, settings);
    add_environment(options.env, settings, job);
    add_size(options.size, settings);
    add_text("output.format", options.format, settings);
    return settings;
}

std::vector<Setting> settings_of_set(const std::vector<std::string>& set) {
    std::vector<Setting> settings;
    for (const std::string& one : set) {
        const auto equals = one.find('=');
        if (equals == 0 || equals == std::string::npos)
            throw Failure(Exit::usage, fmt::format("--set: '{}' is not field=value", one));
        settings.push_back({one.substr(0, equals), one.substr(equals + 1)});
    }
    return settings;
}

// --- The scene as text ---------------------------------------------------------------------------

void check_stdin_is_read_once(const SceneOptions& options) {
    const bool env = options.env == "-" || options.env.starts_with("-,");
    const int readers = (options.relief == "-") + (options.scene == "-") + (options.alpha == "-") +
                        (options.albedo == "-") + (options.bump == "-") + env;
    if (readers > 1) throw Failure(Exit::usage, "stdin (-) can be one input only");
}

std::string scene_file_text(const std::string& argument, SceneJob& job) {
    if (argument.empty()) return "{}";
    const Input file = argument == "-" ? read_input(argument) : read_file(argument);
    if (!file.path.empty()) job.files.push_back(file.path);
    try {
        return server::with_settings(file.bytes, {});
    } catch (const Error& e) {
        throw Failure(Exit::refused, file.name + ": " + part_of_line(e.what()));
    }
}

void check_one_preset(const SceneOptions& options, const std::string& scene_file) {
    if (options.preset.empty() || !server::has_field(scene_file, "preset")) return;
    const std::string name = options.scene == "-" ? "stdin" : options.scene;
    throw Failure(Exit::usage, fmt::format("--preset: {} names a preset itself, which is stronger; "
                                           "--set preset={} replaces it",
                                           name, options.preset));
}

// --- The format ----------------------------------------------------------------------------------

// ".JPG" -> "jpeg"; empty for what ends otherwise
std::string format_of_ending(const fs::path& target) {
    std::string ending = target.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), server::lower);
    if (ending == ".jpg") return "jpeg";
    for (const auto& choice : server::choices_of<PictureFormat>())
        if (ending == "." + std::string(choice.name)) return std::string(choice.name);
    return "";
}

std::string_view name_of(PictureFormat format) {
    for (const auto& choice : server::choices_of<PictureFormat>())
        if (choice.value == format) return choice.name;
    return "";
}

// The scene with the format of the target's ending, where it says none itself.
std::string with_format_of(const std::string& target, std::string scene,
                           std::string_view format_setting) {
    const std::string format = format_of_ending(target);
    if (server::has_field(scene, "output.format")) return scene;
    if (!format.empty()) return server::with_settings(scene, {{"output.format", format}});
    const fs::path path = target;
    std::error_code ignored;
    if (path.has_extension() && !fs::is_other(path, ignored))
        throw Failure(Exit::usage,
                      fmt::format("{}: '{}' is no picture's ending; there are .png, .jpg, .webp "
                                  "and .exr, or say {}",
                                  target, path.extension().string(), format_setting));
    return scene;
}

void check_format(const std::string& target, PictureFormat format,
                  std::string_view format_setting) {
    const std::string ending = format_of_ending(target);
    if (!ending.empty() && ending != name_of(format))
        throw Failure(Exit::usage,
                      fmt::format("{}: the name says {}, output.format says {}; "
                                  "{} {} or another name settles it",
                                  target, ending, name_of(format), format_setting, ending));
}

// --- Images --------------------------------------------------------------------------------------

Input data_input(const ImageSource& source) {
    auto bytes = server::decode_base64(source.text);
    if (!bytes)
        server::refuse_value("is not base64 (RFC 4648, without line breaks)", source.pointer);
    const auto owner = std::make_shared<const std::string>(std::move(*bytes));
    return {server::field_name(source.pointer), {}, {owner, *owner}, server::sha256_hex(*owner)};
}

// "/height/part", and "/height/image" as a server sees it -> "/height"
std::string_view field_of(std::string_view pointer) {
    return pointer.substr(0, pointer.rfind('/'));
}

// Puts an id in the place of whatever names the image.
void resolve(ImageSource& source, const fs::path& folder, bool with_server, SceneJob& job) {
    if (source.kind == ImageSource::Kind::data) {
        source.text = keep(data_input(source), job);
    } else if (source.kind == ImageSource::Kind::part) {
        const fs::path path = folder / source.text;
        std::string& id = job.ids[path.string()];
        if (id.empty()) id = keep(read_file(path), job);
        source.text = id;
    } else if (const auto* sample = server::find_sample(source.text)) {
        source.text = sample->id;
        job.images.emplace(sample->id, read_input("sample:" + sample->id));
    } else if (!with_server && !job.images.contains(source.text)) {
        throw Failure(Exit::refused,
                      server::field_name(source.pointer) + " is stored on a server: give --server");
    }
    source.kind = ImageSource::Kind::image;
}

}  // namespace

SceneJob read_scene_job(const SceneOptions& options, const std::string& target) {
    SceneJob job;
    check_stdin_is_read_once(options);
    const std::vector<Setting> set = settings_of_set(options.set);
    std::string text = scene_file_text(options.scene, job);
    check_one_preset(options, text);
    text = server::with_settings(text, settings_of_flags(options, job));
    text = server::with_settings(text, set);
    if (!server::has_field(text, "height"))
        throw Failure(Exit::usage, "there is no relief: name a file, - or sample:plato");
    finish_scene_job(std::move(text), target, fs::path(options.scene).parent_path(),
                     !options.server.empty(), "--format", job);
    return job;
}

void finish_scene_job(std::string text, const std::string& target, const fs::path& folder,
                      bool with_server, std::string_view format_setting, SceneJob& job) {
    job.scene = server::parse_scene(with_format_of(target, std::move(text), format_setting),
                                    limits_here().max_lights);
    check_format(target, job.scene.output.format, format_setting);
    server::for_each_image(job.scene,
                           [&](ImageSource& source) { resolve(source, folder, with_server, job); });
    job.text = server::scene_json(job.scene);
}

std::string image_name(const server::SceneDescription& scene,
                       const std::map<std::string, Input>& images, const std::string& pointer) {
    std::string name;
    server::for_each_image(scene, [&](const ImageSource& source) {
        const auto found = images.find(source.text);
        const bool blamed = field_of(source.pointer) == field_of(pointer);
        if (blamed && name.empty() && found != images.end()) name = found->second.name;
    });
    return name;
}

}  // namespace relit::cli
