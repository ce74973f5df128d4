#include "server/schema/batch_request.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "server/schema/preset_merge.h"
#include "server/schema/reader.h"
#include "server/schema/scene_json.h"
#include "server/schema/scene_tree.h"
#include "server/schema/sweep.h"
#include "server/text.h"

namespace relit::server {
namespace {

constexpr std::size_t max_name_bytes = 100;  // what every archive can hold

using Check = std::function<void(const SceneDescription&)>;

// A frame as it was sent.
struct SentFrame {
    int number = 0;
    Json own;             // a patch, a scene, or nothing
    std::string pointer;  // where it stands; empty: nowhere
};

// What names of files end in; the first one of a format is what ours do.
constexpr std::pair<std::string_view, PictureFormat> endings[] = {{"png", PictureFormat::png},
                                                                  {"jpg", PictureFormat::jpeg},
                                                                  {"jpeg", PictureFormat::jpeg},
                                                                  {"webp", PictureFormat::webp},
                                                                  {"exr", PictureFormat::exr}};

std::string default_name(int number, int total, PictureFormat format) {
    const auto digits = std::max<std::size_t>(4, std::to_string(total - 1).size());
    const auto* const ending =
        std::find_if(std::begin(endings), std::end(endings),
                     [&](const auto& candidate) { return candidate.second == format; });
    return fmt::format("{:0{}}.{}", number, digits, ending->first);
}

bool is_file_name(std::string_view name) {
    const auto fits = [](char c) {
        return (lower(c) >= 'a' && lower(c) <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
               c == '_' || c == '-';
    };
    return !name.empty() && name.size() <= max_name_bytes && name.front() != '.' &&
           name.front() != '-' && name.back() != '.' && std::all_of(name.begin(), name.end(), fits);
}

// Some file systems take "A.png" and "a.png" for one.
std::string folded(std::string_view name) {
    std::string text(name);
    std::transform(text.begin(), text.end(), text.begin(), lower);
    return text;
}

// Programs open a picture by its name's ending. One that is no picture's says nothing.
void check_ending(const std::string& name, PictureFormat format, const std::string& pointer) {
    const std::string ending = folded(name.substr(std::min(name.rfind('.'), name.size() - 1) + 1));
    for (const auto& [word, its_format] : endings)
        if (word == ending && its_format != format)
            refuse_value(fmt::format("ends in .{}, but the frame's output.format is another", word),
                         pointer);
}

// Takes the name off what the frame is otherwise: no scene has such a field.
std::string taken_name(SentFrame& frame) {
    const std::string pointer = frame.pointer + "/name";
    const auto found = frame.own.is_object() ? frame.own.find("name") : frame.own.end();
    if (!frame.own.is_object() || found == frame.own.end()) return {};
    const Json name = *found;
    frame.own.erase("name");
    if (!name.is_string() || !is_file_name(name.get_ref<const std::string&>()))
        refuse_value(fmt::format("must be a file's name: up to {} letters, digits, '.', '_' and "
                                 "'-', the first one a letter, a digit or '_'",
                                 max_name_bytes),
                     pointer);
    if (folded(name.get<std::string>()) == problems_file_name)
        refuse_value("is the name of an archive's list of problems", pointer);
    return name.get<std::string>();
}

bool has(const Json& tree, const std::string& pointer) {
    try {
        return !tree.is_null() && tree.contains(Json::json_pointer(pointer));
    } catch (const Json::exception&) {
        return false;
    }
}

std::string parent_of(const std::string& pointer) {
    return pointer.substr(0, std::min(pointer.rfind('/'), pointer.size()));
}

// Where a scene's field was sent: in the frame, or in the scene that it was laid over.
std::string sent_at(const std::string& field, const SentFrame& frame, const Json& base) {
    if (field.starts_with("/sweep/")) return field;
    if (base.is_null()) return frame.pointer + field;
    const std::string parent = parent_of(field);
    const bool in_frame =
        !frame.pointer.empty() &&
        (has(frame.own, field) || (!has(base, field) && !parent.empty() && has(frame.own, parent)));
    return (in_frame ? frame.pointer : "/scene") + field;
}

class BatchReader {
public:
    BatchReader(const Json& json, const BatchLimits& limits, const Check& check)
        : reader_(json, ""), limits_(limits), check_(check) {}

    BatchRequest read_batch() {
        const Json* const scene = reader_.take("scene");
        const Json* const frames = reader_.take("frames");
        const Json* const sweep = reader_.take("sweep");
        const Json* const scenes = reader_.take("scenes");
        if (const Json* json = reader_.take("priority"))
            read(*json, batch_.priority, from_to(-100, 100), "/priority");
        reader_.finish();
        if ((scenes ? 1 : 0) + (frames ? 1 : 0) + (sweep ? 1 : 0) != 1)
            throw Error(error_code::missing_field,
                        "a batch is 'scene' and 'frames', 'scene' and 'sweep', or 'scenes'");
        if (scenes && scene) refuse_value("and 'scenes' exclude each other", "/scene");
        if (!scenes && !scene)
            throw Error(error_code::missing_field, "'scene' is missing", "/scene");
        if (scene && !scene->is_object()) refuse_value("must be an object", "/scene");
        if (scenes) read_list(*scenes, "/scenes", nullptr);
        if (frames) read_list(*frames, "/frames", *scene);
        if (sweep) read_sweep(*sweep, *scene);
        check_names();
        return std::move(batch_);
    }

private:
    void read_list(const Json& list, const std::string& pointer, const Json& base) {
        if (!list.is_array() || list.empty())
            refuse_value("must be a list of at least one", pointer);
        check_count(list.size(), pointer);
        total_ = int(list.size());
        for (int i = 0; i < total_; ++i) {
            SentFrame frame{i, list[std::size_t(i)], fmt::format("{}/{}", pointer, i)};
            const std::string name = taken_name(frame);
            if (!frame.own.is_object()) refuse_value("must be an object", frame.pointer);
            add(frame, base, name,
                [&] { return base.is_null() ? frame.own : laid_over(base, frame.own); });
        }
    }

    void read_sweep(const Json& json, const Json& scene) {
        const Sweep sweep = sweep_from(json, limits_.max_frames, "/sweep");
        check_alone(scene);
        total_ = sweep.count;
        for (int i = 0; i < total_; ++i)
            add({i, nullptr, ""}, scene, "", [&] { return swept(scene, sweep, i); });
    }

    // A sweep replaces a light, whatever is wrong with it.
    void check_alone(const Json& scene) const try {
        (void)scene_from(scene, limits_.max_lights);
    } catch (const Error& e) {
        throw Error(e.code, e.what(), "/scene" + e.pointer, e.limit);
    }

    // An error in the scene says in which frame it is, and where that was sent.
    template <class Tree>
    void add(const SentFrame& frame, const Json& base, const std::string& name, const Tree& tree) {
        PictureFormat format{};
        try {
            const SceneDescription scene = scene_from(tree(), limits_.max_lights);
            check_(scene);
            format = scene.output.format;
            batch_.frames.push_back({name, scene_json(scene)});
        } catch (const Error& e) {
            if (e.code == error_code::storage_failed) throw;
            throw Error(e.code, fmt::format("frame {}: {}", frame.number, e.what()),
                        sent_at(e.pointer, frame, base), e.limit);
        }
        if (name.empty()) batch_.frames.back().name = default_name(frame.number, total_, format);
        else check_ending(name, format, frame.pointer + "/name");
    }

    void check_count(std::size_t count, const std::string& pointer) const {
        if (count > std::size_t(limits_.max_frames))
            refuse_value(fmt::format("has {} entries; the limit is {} (max-batch-frames)", count,
                                     limits_.max_frames),
                         pointer, "max-batch-frames");
    }

    void check_names() const {
        std::set<std::string> names;
        for (std::size_t i = 0; i < batch_.frames.size(); ++i)
            if (!names.insert(folded(batch_.frames[i].name)).second)
                throw Error(error_code::duplicate_field,
                            fmt::format("frame {}: the name '{}' is there twice", i,
                                        batch_.frames[i].name));
    }

    Reader reader_;
    const BatchLimits& limits_;
    const Check& check_;
    int total_ = 0;
    BatchRequest batch_;
};

}  // namespace

BatchRequest parse_batch(std::string_view json, const BatchLimits& limits, const Check& check) {
    const Json tree = parse_json(json, limits.json);
    if (!tree.is_object()) throw Error(error_code::invalid_value, "the batch must be an object");
    return BatchReader(tree, limits, check).read_batch();
}

}  // namespace relit::server
