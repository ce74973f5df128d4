// Includes point along the layers' arrows: core's order stands in core/CMakeLists.txt, and what
// only one folder may include is listed here.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace relit::test {
namespace {

namespace fs = std::filesystem;

struct Include {
    std::string file;  // relative to the source folder
    std::string target;
};

const fs::path source_folder = RELIT_SOURCE_DIR;

std::vector<Include> includes_below(const std::string& folder) {
    static const std::regex line_form(R"re(^\s*#\s*include\s*[<"]([^>"]+)[>"])re");
    std::vector<Include> includes;
    for (const fs::directory_entry& entry :
         fs::recursive_directory_iterator(source_folder / folder)) {
        if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
        std::ifstream file(entry.path());
        std::smatch match;
        for (std::string line; std::getline(file, line);)
            if (std::regex_search(line, match, line_form))
                includes.push_back(
                    {entry.path().lexically_relative(source_folder).generic_string(), match[1]});
    }
    return includes;
}

// "core/render/render.h" -> "render"
std::string module_of(const std::string& path) {
    const std::size_t begin = path.find('/') + 1;
    return path.substr(begin, path.find('/', begin) - begin);
}

std::map<std::string, std::set<std::string>> allowed_in_core() {
    std::ifstream file(source_folder / "core" / "CMakeLists.txt");
    static const std::regex row(R"(^#\s+([a-z]+)\s+:\s*([a-z ]*)$)");
    std::map<std::string, std::set<std::string>> allowed;
    std::smatch match;
    for (std::string line; std::getline(file, line);) {
        if (!std::regex_match(line, match, row)) continue;
        std::istringstream words(match[2]);
        auto& modules = allowed[match[1]];
        modules.insert(match[1]);
        for (std::string word; words >> word;) modules.insert(word);
    }
    return allowed;
}

TEST(Structure, CoreIncludesPointAlongItsLayers) {
    const auto allowed = allowed_in_core();
    ASSERT_EQ(allowed.size(), 10u) << "the table in core/CMakeLists.txt";
    const auto includes = includes_below("core");
    ASSERT_GT(includes.size(), 50u);
    for (const Include& include : includes) {
        if (!include.target.starts_with("core/")) {
            EXPECT_FALSE(include.target.starts_with("server/"))
                << include.file << " includes " << include.target;
            continue;
        }
        const std::string from = module_of(include.file);
        ASSERT_TRUE(allowed.contains(from))
            << from << " is not in the table of core/CMakeLists.txt";
        EXPECT_TRUE(allowed.at(from).contains(module_of(include.target)))
            << include.file << " includes " << include.target;
    }
}

TEST(Structure, EachLibraryIsKnownToOneFolder) {
    const std::pair<const char*, const char*> owners[] = {
        {"immintrin.h", "core/base/wide/"},
        {"OpenImageIO/", "core/io/"},
        {"oneapi/tbb", "core/base/parallel.cpp"},
        {"tbb/", "core/base/parallel.cpp"},
        {"kiss", "core/transport/convolution.cpp"},
        {"httplib.h", "server/http/server.cpp"},
        {"nlohmann/", "server/schema/"},
        {"openssl/", "server/storage/"},
        {"sqlite3.h", "server/jobs/"},
        {"isa-l/", "core/io/"},
        {"turbojpeg.h", "core/io/"},
    };
    constexpr const char* http_client = "clients/cli/http_client.cpp";
    auto includes = includes_below("core");
    for (const char* folder : {"server", "clients/cli"})
        for (const Include& include : includes_below(folder)) includes.push_back(include);
    for (const auto& [library, owner] : owners)
        for (const Include& include : includes)
            if (include.target.starts_with(library)) {
                EXPECT_TRUE(include.file.starts_with(owner) ||
                            (include.target == "httplib.h" && include.file == http_client))
                    << include.file << " includes " << include.target;
            }
}

// Nobody can make the server ask for something elsewhere: it has nothing to ask with. (The library in
// server/http could, through the client class that is named here.)
TEST(Structure, NothingInTheServerOpensAConnection) {
    static const std::regex calls(
        R"(\b(connect|getaddrinfo|gethostbyname|sendto|sendmsg)\s*\(|httplib::(SSL)?Client|\bcurl_)");
    int files = 0;
    for (const char* folder : {"core", "server"})
        for (const fs::directory_entry& entry :
             fs::recursive_directory_iterator(source_folder / folder)) {
            if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
            // To its own processes, over pairs of sockets that nobody else can reach.
            if (entry.path() == source_folder / "server/decoding/messages.cpp") continue;
            std::ifstream file(entry.path());
            ++files;
            for (std::string line; std::getline(file, line);)
                EXPECT_FALSE(std::regex_search(line, calls)) << entry.path() << ": " << line;
        }
    EXPECT_GT(files, 200);
}

// The command line renders what the server renders, and knows nothing of how it serves.
TEST(Structure, TheCommandLineIncludesNoServerOverHttp) {
    constexpr const char* allowed[] = {
        "clients/cli/",
        "core/",
        "server/schema/",
        "server/scenes/",
        "server/samples/",
        "server/limits.h",
        "server/text.h",
        "server/error_codes.h",
        "server/shared_bytes.h",
        "server/storage/sha256.h",
        "server/access/signed_url.h",
    };
    const auto includes = includes_below("clients/cli");
    ASSERT_GT(includes.size(), 50u);
    for (const Include& include : includes) {
        const bool ours = include.target.starts_with("clients/") ||
                          include.target.starts_with("core/") ||
                          include.target.starts_with("server/");
        EXPECT_TRUE(!ours || std::any_of(std::begin(allowed), std::end(allowed),
                                         [&](const char* prefix) {
                                             return include.target.starts_with(prefix);
                                         }))
            << include.file << " includes " << include.target;
    }
}

TEST(Structure, TheServersMathematicsIsCores) {
    for (const Include& include : includes_below("server")) {
        EXPECT_FALSE(include.target.starts_with("core/visibility/") ||
                     include.target.starts_with("core/shade/factors"))
            << include.file << " includes " << include.target;
    }
}

}  // namespace
}  // namespace relit::test
