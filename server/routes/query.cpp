#include "server/routes/query.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/error_codes.h"
#include "server/text.h"

namespace relit::server {

void allow_parameters(const Request& request, std::initializer_list<std::string_view> names) {
    for (const auto& [name, value] : request.query) {
        if (std::find(names.begin(), names.end(), name) == names.end())
            throw Error(error_code::unknown_field,
                        fmt::format("there is no parameter '{}' here", name));
        if (request.query.count(name) > 1)
            throw Error(error_code::duplicate_field,
                        fmt::format("the parameter '{}' is there twice", name));
    }
}

std::size_t page_size(const Request& request) {
    const auto text = request.query_value("limit");
    if (!text) return 100;
    const auto size = parse_number<std::size_t>(*text);
    if (!size || *size < 1 || *size > 1000)
        throw Error(error_code::invalid_value,
                    "the parameter 'limit' must be a whole number from 1 to 1000");
    return *size;
}

std::string token_header(const Request& request, std::string_view name) {
    const auto token = request.header(name);
    if (!token) return {};
    const bool visible =
        std::all_of(token->begin(), token->end(), [](char c) { return c > ' ' && c < 0x7f; });
    if (token->empty() || token->size() > 128 || !visible)
        throw Error(error_code::malformed_request,
                    fmt::format("the header {} must have 1 to 128 visible ASCII characters", name));
    return *token;
}

}  // namespace relit::server
