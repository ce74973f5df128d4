// What is fuzzed: functions of one input, that of libFuzzer or of the replay test. Each sends its
// input where a client's bytes go and throws where something does not hold that always should; what
// a sanitizer sees is its own affair.
#pragma once

#include <string_view>

namespace relit::fuzz {

void scene(std::string_view input);       ///< the JSON of a scene
void batch(std::string_view input);       ///< the JSON of a batch
void parameters(std::string_view input);  ///< a GET's target; then its headers, a line each
void multipart(std::string_view input);   ///< a form's content type; after a line's end its body
void http(std::string_view input);  ///< bytes of a connection, cut as the first line says (http.cpp)
void decode(std::string_view input);  ///< an image file of any format

struct Target {
    const char* name;  ///< of the program relit_fuzz_<name> and of the folder of its seeds
    void (*run)(std::string_view input);
};

inline constexpr Target targets[] = {
    {"scene", scene},         {"batch", batch}, {"parameters", parameters},
    {"multipart", multipart}, {"http", http},   {"decode", decode}};

}  // namespace relit::fuzz
