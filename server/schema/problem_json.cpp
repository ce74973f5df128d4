#include "server/schema/problem_json.h"

#include <nlohmann/json.hpp>

namespace relit::server {

std::string problem_json(const Problem& problem) {
    nlohmann::ordered_json json = {
        {"type", "/problems/" + std::string(problem.code)},
        {"title", problem.title},
        {"status", problem.status},
        {"detail", problem.detail},
    };
    if (!problem.pointer.empty()) json["pointer"] = problem.pointer;
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

int problem_status(std::string_view document) {
    return nlohmann::json::parse(document).at("status").get<int>();
}

}  // namespace relit::server
