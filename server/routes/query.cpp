#include "server/routes/query.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "server/error_codes.h"

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

}  // namespace relit::server
