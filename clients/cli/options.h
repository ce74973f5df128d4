// The command line of relit: what can be asked for, and the parser that reads and explains it.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;  // its header takes a compiler seconds: only those who ask it include it
}

namespace relit::cli {

/// What names a scene: the inputs that `relit render` and `relit scene` share.
struct SceneOptions {
    std::string relief;  ///< a path, "-" or "sample:NAME"; empty: the scene file names it
    std::string scene;   ///< a path or "-"; empty: none
    std::string preset;
    std::string light;
    std::string sun;
    std::string env;
    std::string alpha;
    std::string albedo;
    std::string bump;
    std::string size;
    std::string format;
    std::vector<std::string> set;  ///< "path=value"
    std::string server;            ///< empty: this machine renders
    int threads = 0;
};

/// What `relit sweep` does to the light, as texts: what they may be is the sweep's business.
struct SweepOptions {
    std::string orbit;  ///< the number of frames; one of these four is there
    std::string arc;
    std::string line;
    std::string turn;
    std::string from;
    std::string to;
    std::string azimuth;
    std::string elevation;
    std::string turns;
    std::string easing;
    std::string light;  ///< which of several
    bool returns = false;
};

inline constexpr const char* lossless_word = "lossless";

/// Of what becomes of the frames together.
struct AnimationFlags {
    std::string target;                    ///< a path or "-"; empty: no animation
    std::string frames_per_second = "25";  ///< 1 to 90
    std::string quality = "85";            ///< 1 to 100 or lossless_word
};

struct Options {
    SceneOptions scene;
    SweepOptions sweep;
    AnimationFlags animation;
    std::string manifest;  ///< of `relit batch`: a path or "-"
    std::string output;
    std::string shard;  ///< "i/n"; empty: all frames
    bool quiet = false;
    bool json = false;
    bool etag = false;
    std::vector<std::string> files;
    std::string sample;
    std::string url;      ///< of `relit sign-url`
    int valid_s = 86400;  ///< how long it is good
    std::string shell;
};

/// The kinds of values, as --help shows them and completion knows them.
namespace value {
inline constexpr const char* image = "FILE";       ///< a file or a sample
inline constexpr const char* file = "PATH";        ///< a file
inline constexpr const char* environment = "ENV";  ///< an image, maybe with angles behind it
inline constexpr const char* preset = "PRESET";    ///< a preset's name
inline constexpr const char* sample = "SAMPLE";    ///< a sample's name
inline constexpr const char* format = "FORMAT";    ///< of a picture
inline constexpr const char* setting = "FIELD=VALUE";
inline constexpr const char* easing = "EASING";
inline constexpr const char* quality = "QUALITY";  ///< of an animation
inline constexpr const char* shell = "SHELL";
}  // namespace value

/// Declares commands and flags; parsing fills `options`.
void declare_options(CLI::App& app, Options& options);

}  // namespace relit::cli
