// JSON -> structs: the visitor of the field table that reads, and the types it knows. Every refusal
// names its field.
#pragma once

#include <string>

#include "server/error_codes.h"
#include "server/schema/field_error.h"
#include "server/schema/fields.h"
#include "server/schema/strict_json.h"

namespace relit::server {

/// Reads the fields of one JSON object.
class Reader {
public:
    /// @throws Error invalid_value when `json` is not an object
    Reader(const Json& json, std::string pointer);

    template <class T, class Rule>
    void operator()(std::string_view name, T& member, const Rule& rule,
                    std::string_view /*sentence*/);

    void lights(std::string_view one, std::string_view several,
                std::vector<LightDescription>& lights, std::string_view sentence);

    /// The field, remembered as known; null where it is not there, or discarded (preset_merge.h).
    const Json* take(std::string_view name);
    [[nodiscard]] std::string pointer_to(std::string_view name) const;

    /// @throws Error unknown_field for a field that nobody took; it names the known ones
    void finish() const;

    int max_lights = 1;

private:
    const Json& json_;
    std::string pointer_;
    std::vector<std::string_view> known_;
};

// What a value may be, type by type; `pointer` is where it stands. @throws Error invalid_value
void read(const Json& json, double& value, Range range, const std::string& pointer);
void read(const Json& json, int& value, Range range, const std::string& pointer);
void read(const Json& json, bool& value, Any, const std::string& pointer);
void read(const Json& json, std::optional<int>& value, Range range, const std::string& pointer);
void read(const Json& json, std::optional<double>& value, RangeOrNull rule,
          const std::string& pointer);
void read(const Json& json, std::optional<double>& value, RangeOrWord rule,
          const std::string& pointer);
void read(const Json& json, Vec3& value, Range range, const std::string& pointer);
void read(const Json& json, std::optional<Vec3>& value, Range range, const std::string& pointer);
void read(const Json& json, Rotation& value, Range range, const std::string& pointer);
void read(const Json& json, Falloff& value, Range range, const std::string& pointer);
void read(const Json& json, Colour& value, Any, const std::string& pointer);
void read(const Json& json, std::optional<Colour>& value, Any, const std::string& pointer);
void read(const Json& json, Base& value, Range range, const std::string& pointer);
void read(const Json& json, std::optional<Rect>& value, Any, const std::string& pointer);
void read(const Json& json, std::array<double, 3>& value, Range range, const std::string& pointer);
void read(const Json& json, std::array<double, 3>& value, RequiredIn rule,
          const std::string& pointer);
void read(const Json& json, scatter::Medium& value, Any, const std::string& pointer);
void read(const Json& json, std::optional<Film>& value, Any, const std::string& pointer);
void read(const Json& json, ImageSource& value, Required, const std::string& pointer);
void read(const Json& json, std::optional<ImageSource>& value, Any, const std::string& pointer);
void read(const Json& json, LightDescription& value, const std::string& pointer);

/// "'a', 'b' or 'c'"
[[nodiscard]] std::string listed(const std::vector<std::string_view>& words,
                                 std::string_view last = "or");

template <class T>
concept Enumeration = std::is_enum_v<T>;

template <Enumeration T>
void read(const Json& json, T& value, Any, const std::string& pointer) {
    std::vector<std::string_view> words;
    for (const auto& choice : choices_of<T>()) {
        if (json.is_string() && json.get_ref<const std::string&>() == choice.name) {
            value = choice.value;
            return;
        }
        words.push_back(choice.name);
    }
    refuse_value("must be " + listed(words), pointer);
}

/// A struct with rows of its own.
template <class T>
requires requires(Reader& reader, T& value) { fields(reader, value); }
void read(const Json& json, T& value, Any, const std::string& pointer) {
    Reader reader(json, pointer);
    fields(reader, value);
    reader.finish();
}

template <class T, class Rule>
void Reader::operator()(std::string_view name, T& member, const Rule& rule, std::string_view) {
    if (const Json* json = take(name)) {
        read(*json, member, rule, pointer_to(name));
    } else if constexpr (is_required<Rule>) {
        throw Error(error_code::missing_field, field_name(pointer_to(name)) + " is missing",
                    pointer_to(name));
    }
}

}  // namespace relit::server
