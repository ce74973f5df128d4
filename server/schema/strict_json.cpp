#include "server/schema/strict_json.h"

#include <set>

#include "server/error_codes.h"
#include "server/schema/field_error.h"

namespace relit::server {
namespace {

// Follows the parser through the text: where it is, and which keys each open object has had.
class Place {
public:
    explicit Place(const JsonLimits& limits) : limits_(limits) {}

    bool operator()(int /*depth*/, Json::parse_event_t event, Json& parsed) {
        using Event = Json::parse_event_t;
        count(event);
        switch (event) {
            case Event::object_start:
                open(false);
                break;
            case Event::array_start:
                open(true);
                break;
            case Event::key:
                enter_key(parsed.get_ref<const std::string&>());
                break;
            case Event::object_end:
            case Event::array_end:
                levels_.pop_back();
                value_done();
                break;
            case Event::value:
                value_done();
                break;
        }
        return true;
    }

    [[nodiscard]] std::string pointer() const {
        std::string pointer;
        for (const Level& level : levels_)
            pointer +=
                '/' + (level.is_array ? std::to_string(level.index) : pointer_token(level.key));
        return pointer;
    }

private:
    struct Level {
        bool is_array = false;
        std::size_t index = 0;
        std::string key;
        std::set<std::string, std::less<>> keys;
    };

    void count(Json::parse_event_t event) {
        using Event = Json::parse_event_t;
        if (event == Event::key || event == Event::object_end || event == Event::array_end) return;
        if (++values_ > limits_.max_values)
            throw Error(error_code::malformed_json,
                        "the JSON has more than " + std::to_string(limits_.max_values) +
                            " values (max-json-values)",
                        {}, "max-json-values");
    }

    void open(bool is_array) {
        if (levels_.size() >= std::size_t(limits_.max_depth))
            throw Error(error_code::malformed_json,
                        "the JSON is nested deeper than " + std::to_string(limits_.max_depth) +
                            " levels (max-json-depth)",
                        pointer(), "max-json-depth");
        levels_.push_back({is_array, 0, {}, {}});
    }

    void enter_key(const std::string& key) {
        Level& level = levels_.back();
        level.key = key;
        if (!level.keys.insert(key).second)
            throw Error(error_code::duplicate_field, field_name(pointer()) + " is there twice",
                        pointer());
    }

    void value_done() {
        if (!levels_.empty() && levels_.back().is_array) ++levels_.back().index;
    }

    const JsonLimits& limits_;
    int values_ = 0;
    std::vector<Level> levels_;
};

}  // namespace

Json parse_json(std::string_view text, const JsonLimits& limits) {
    Place place(limits);
    try {
        return Json::parse(text, [&](int depth, Json::parse_event_t event, Json& parsed) {
            return place(depth, event, parsed);
        });
    } catch (const Json::parse_error& e) {
        throw Error(error_code::malformed_json,
                    "the text is not JSON: reading stopped at byte " + std::to_string(e.byte));
    } catch (const Json::out_of_range&) {
        throw Error(error_code::invalid_value,
                    field_name(place.pointer()) + " is too large a number", place.pointer());
    }
}

std::string pointer_token(std::string_view key) {
    std::string token;
    for (const char c : key) {
        if (c == '~') token += "~0";
        else if (c == '/') token += "~1";
        else token += c;
    }
    return token;
}

}  // namespace relit::server
