// JSON Schema (2020-12) as far as the interface's description uses it: judges values, so that tests
// can compare the description with what the server takes. An unknown keyword is an error: nothing
// is judged by half.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>

namespace relit::test {

class JsonSchema {
public:
    using Json = nlohmann::json;

    /// @param document  what "#/..." references are looked up in; must outlive this
    explicit JsonSchema(const Json& document) : document_(document) {}

    [[nodiscard]] bool accepts(const Json& schema, const Json& value) const {
        for (const auto& [keyword, rule] : schema.items())
            if (!keeps(schema, keyword, rule, value)) return false;
        return true;
    }

private:
    [[nodiscard]] bool keeps(const Json& schema, const std::string& keyword, const Json& rule,
                             const Json& value) const {
        static const std::set<std::string> says_nothing = {"description",      "default",
                                                           "contentMediaType", "contentSchema",
                                                           "contentEncoding",  "format"};
        if (says_nothing.contains(keyword)) return true;
        if (keyword == "$ref")
            return accepts(document_.at(Json::json_pointer(rule.get<std::string>().substr(1))),
                           value);
        if (keyword == "type") return is_of(rule, value);
        if (keyword == "const") return value == rule;
        if (keyword == "enum") return std::find(rule.begin(), rule.end(), value) != rule.end();
        if (keyword == "anyOf") return count(rule, value) >= 1;
        if (keyword == "oneOf") return count(rule, value) == 1;
        if (keyword == "not") return !accepts(rule, value);
        if (value.is_number()) return keeps_number(keyword, rule, value.get<double>());
        if (value.is_string()) return keeps_text(keyword, rule, value.get<std::string>());
        if (value.is_array()) return keeps_list(schema, keyword, rule, value);
        if (value.is_object()) return keeps_object(schema, keyword, rule, value);
        return true;
    }

    [[nodiscard]] static bool is_of(const Json& type, const Json& value) {
        if (type.is_array())
            return std::any_of(type.begin(), type.end(),
                               [&](const Json& one) { return is_of(one, value); });
        if (type == "integer")
            return value.is_number() && value.get<double>() == std::floor(value.get<double>());
        if (type == "number") return value.is_number();
        return type == value.type_name();
    }

    [[nodiscard]] int count(const Json& schemas, const Json& value) const {
        return int(std::count_if(schemas.begin(), schemas.end(),
                                 [&](const Json& one) { return accepts(one, value); }));
    }

    [[nodiscard]] static bool keeps_number(const std::string& keyword, const Json& rule,
                                           double value) {
        if (keyword == "minimum") return value >= rule.get<double>();
        if (keyword == "maximum") return value <= rule.get<double>();
        if (keyword == "exclusiveMinimum") return value > rule.get<double>();
        return is_of_another_type(keyword);
    }

    [[nodiscard]] static bool keeps_text(const std::string& keyword, const Json& rule,
                                         const std::string& value) {
        if (keyword == "pattern")
            return std::regex_search(value, std::regex(rule.get<std::string>()));
        if (keyword == "minLength") return value.size() >= rule.get<std::size_t>();
        if (keyword == "maxLength") return value.size() <= rule.get<std::size_t>();
        return is_of_another_type(keyword);
    }

    [[nodiscard]] bool keeps_list(const Json& schema, const std::string& keyword, const Json& rule,
                                  const Json& value) const {
        if (keyword == "minItems") return value.size() >= rule.get<std::size_t>();
        if (keyword == "maxItems") return value.size() <= rule.get<std::size_t>();
        if (keyword == "prefixItems") {
            for (std::size_t i = 0; i < std::min(value.size(), rule.size()); ++i)
                if (!accepts(rule[i], value[i])) return false;
            return true;
        }
        if (keyword == "items") {
            const std::size_t first =
                schema.contains("prefixItems") ? schema["prefixItems"].size() : 0;
            for (std::size_t i = first; i < value.size(); ++i)
                if (!accepts(rule, value[i])) return false;
            return true;
        }
        return is_of_another_type(keyword);
    }

    [[nodiscard]] bool keeps_object(const Json& schema, const std::string& keyword,
                                    const Json& rule, const Json& value) const {
        if (keyword == "required")
            return std::all_of(rule.begin(), rule.end(),
                               [&](const Json& name) { return value.contains(name); });
        if (keyword == "properties") {
            for (const auto& [name, property] : rule.items())
                if (value.contains(name) && !accepts(property, value[name])) return false;
            return true;
        }
        if (keyword == "additionalProperties") {
            for (const auto& [name, member] : value.items())
                if (!schema.contains("properties") || !schema["properties"].contains(name))
                    if (rule.is_boolean() ? !rule.get<bool>() : !accepts(rule, member))
                        return false;
            return true;
        }
        return is_of_another_type(keyword);
    }

    // Keywords for values of another type hold for this one.
    [[nodiscard]] static bool is_of_another_type(const std::string& keyword) {
        static const std::set<std::string> known = {"minimum",
                                                    "maximum",
                                                    "exclusiveMinimum",
                                                    "pattern",
                                                    "minLength",
                                                    "maxLength",
                                                    "minItems",
                                                    "maxItems",
                                                    "prefixItems",
                                                    "items",
                                                    "required",
                                                    "properties",
                                                    "additionalProperties"};
        if (!known.contains(keyword)) throw std::logic_error("unknown keyword " + keyword);
        return true;
    }

    const Json& document_;
};

}  // namespace relit::test
