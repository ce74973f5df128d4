#include "server/schema/sweep.h"

#include <spdlog/fmt/fmt.h>

#include <initializer_list>

#include "server/schema/batch_request.h"
#include "server/schema/preset_merge.h"
#include "server/schema/reader.h"

namespace relit::server {

template <>
constexpr auto choices_of<Sweep::Path>() {
    return std::array{Choice{"orbit", Sweep::Path::orbit}, Choice{"arc", Sweep::Path::arc},
                      Choice{"line", Sweep::Path::line},
                      Choice{"environment", Sweep::Path::environment}};
}
template <>
constexpr auto choices_of<Easing>() {
    return std::array{Choice{"linear", Easing::linear}, Choice{"ease-in", Easing::ease_in},
                      Choice{"ease-out", Easing::ease_out},
                      Choice{"ease-in-out", Easing::ease_in_out}};
}

namespace {

constexpr Range whole_turns = from_to(-100, 100);
constexpr Range elevations = from_to(-90, 90);

void read_angles(const Json& json, Angles& angles, const std::string& pointer) {
    if (!json.is_array() || json.size() != 2)
        refuse_value("must be [azimuth, elevation]: 2 numbers", pointer);
    read(json[0], angles.azimuth_deg, turns, pointer + "/0");
    read(json[1], angles.elevation_deg, elevations, pointer + "/1");
}

const Json& required(Reader& reader, const char* name) {
    if (const Json* value = reader.take(name)) return *value;
    throw Error(error_code::missing_field, field_name(reader.pointer_to(name)) + " is missing",
                reader.pointer_to(name));
}

void read_turns(Reader& reader, Sweep& sweep) {
    int turns_wanted = 1;
    if (const Json* json = reader.take("turns"))
        read(*json, turns_wanted, whole_turns, reader.pointer_to("turns"));
    if (turns_wanted == 0) refuse_value("must not be 0", reader.pointer_to("turns"));
    sweep.turns_deg = 360.0 * turns_wanted;
    sweep.ends = PathEnds::closed;
}

void read_orbit(Reader& reader, Sweep& sweep) {
    const DirectionalLight sun;
    Angles& from = sweep.from_angles = {sun.azimuth_deg, sun.elevation_deg};
    if (const Json* json = reader.take("azimuth"))
        read(*json, from.azimuth_deg, turns, reader.pointer_to("azimuth"));
    if (const Json* json = reader.take("elevation"))
        read(*json, from.elevation_deg, elevations, reader.pointer_to("elevation"));
    read_turns(reader, sweep);
    sweep.to_angles = {from.azimuth_deg + sweep.turns_deg, from.elevation_deg};
}

void read_ends(Reader& reader, Sweep& sweep) {
    bool returns = false;
    if (const Json* json = reader.take("returns"))
        read(*json, returns, Any{}, reader.pointer_to("returns"));
    if (returns) sweep.ends = PathEnds::returns;
}

// The light that a sweep moves, in a scene that has been laid over its preset.
Json& moved_light(Json& scene, const Sweep& sweep) {
    const auto lights = scene.find("lights");
    const bool several = lights != scene.end() && lights->is_array();
    const std::size_t count = several ? lights->size() : 1;
    if (std::size_t(sweep.light) >= count)
        refuse_value(fmt::format("is light {} of a scene that has {}", sweep.light, count),
                     "/sweep/light");
    return several ? (*lights)[std::size_t(sweep.light)] : scene["light"];
}

std::string type_of(const Json& light) {
    const auto type = light.is_object() ? light.find("type") : light.end();
    return light.is_object() && type != light.end() && type->is_string() ? type->get<std::string>()
                                                                         : "";
}

// A light of that type, with what the old one had.
Json light_like(const Json& old, const char* type) {
    const std::string old_type = type_of(old);
    if (old_type == type) return old;
    Json light = {{"type", type}};
    if (old_type == "environment" || !old.is_object()) return light;
    for (const char* kept : {"color", "intensity"})
        if (old.contains(kept)) light[kept] = old[kept];
    return light;
}

void point_sun(Json& light, Angles angles) {
    light = light_like(light, "directional");
    light.erase("direction");
    light["azimuth"] = angles.azimuth_deg;
    light["elevation"] = angles.elevation_deg;
}

void turn_environment(Json& light, double degrees) {
    if (type_of(light) != "environment")
        refuse_value("must not be 'environment' where the light is none", "/sweep/path");
    Json& rotation = light["rotation"];
    if (rotation.is_null() || rotation.is_discarded()) rotation = {0, 0};
    if (rotation.is_array() && !rotation.empty() && rotation[0].is_number())
        rotation[0] = within_a_turn(rotation[0].get<double>() + degrees);
}

}  // namespace

Sweep sweep_from(const Json& json, int max_count, const std::string& pointer) {
    Reader reader(json, pointer);
    Sweep sweep;
    read(required(reader, "path"), sweep.path, Any{}, pointer + "/path");
    read(required(reader, "count"), sweep.count, from_to(1, max_count), pointer + "/count");
    if (const Json* light = reader.take("light"))
        read(*light, sweep.light, from_to(0, 1'000'000), pointer + "/light");
    if (const Json* easing = reader.take("easing"))
        read(*easing, sweep.easing, Any{}, pointer + "/easing");
    switch (sweep.path) {
        case Sweep::Path::orbit:
            read_orbit(reader, sweep);
            break;
        case Sweep::Path::environment:
            read_turns(reader, sweep);
            break;
        case Sweep::Path::arc:
            read_angles(required(reader, "from"), sweep.from_angles, pointer + "/from");
            read_angles(required(reader, "to"), sweep.to_angles, pointer + "/to");
            read_ends(reader, sweep);
            break;
        case Sweep::Path::line:
            read(required(reader, "from"), sweep.from_position, anywhere, pointer + "/from");
            read(required(reader, "to"), sweep.to_position, anywhere, pointer + "/to");
            read_ends(reader, sweep);
            break;
    }
    reader.finish();
    return sweep;
}

std::vector<std::string> easing_words() {
    std::vector<std::string> words;
    for (const auto& choice : choices_of<Easing>()) words.emplace_back(choice.name);
    return words;
}

Json swept(const Json& scene, const Sweep& sweep, int frame) {
    Json result = over_preset(scene);
    Json& light = moved_light(result, sweep);
    const double share = path_share(frame, sweep.count, sweep.ends, sweep.easing);
    switch (sweep.path) {
        case Sweep::Path::orbit:
        case Sweep::Path::arc:
            point_sun(light, between(sweep.from_angles, sweep.to_angles, share));
            break;
        case Sweep::Path::line: {
            const Vec3 position = between(sweep.from_position, sweep.to_position, share);
            light = light_like(light, "point");
            light["position"] = {position.x, position.y, position.z};
            break;
        }
        case Sweep::Path::environment:
            turn_environment(light, share * sweep.turns_deg);
            break;
    }
    return result;
}

}  // namespace relit::server
