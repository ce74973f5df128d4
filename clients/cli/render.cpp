// relit render, relit scene: a scene read, then rendered or told, here or by a server.
#include "clients/cli/commands.h"
#include "clients/cli/failure.h"
#include "clients/cli/limits_here.h"
#include "clients/cli/remote.h"
#include "clients/cli/scene_job.h"
#include "server/scenes/picture_etag.h"
#include "server/scenes/picture_file.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/client_json.h"

namespace relit::cli {
namespace {

Scene load_here(const SceneJob& job, const Executor& executor, Progress& progress) {
    const auto find = [&](const server::ImageSource& source) {
        const Input& input = job.images.at(source.text);
        progress.begin("reading " + input.name);
        return input.bytes;
    };
    try {
        SharedCache once(0);  // nobody asks again
        return server::load_scene(job.scene, find, decode_here, limits_here(), executor, once);
    } catch (const Error& e) {
        const std::string name = image_name(job.scene, job.images, e.pointer);
        if (name.empty()) throw;
        throw Failure(Exit::refused, name + ": " + part_of_line(e.what()));
    }
}

std::string render_here(const SceneJob& job, int threads, Progress& progress) {
    const Executor executor(threads);
    const Scene scene = load_here(job, executor, progress);
    progress.begin("rendering");
    return server::picture_file(
               scene, job.scene, job.text,
               {.executor = executor, .progress = [&](double share) { progress.reach(share); }})
        .bytes;
}

}  // namespace

void render_command(const Options& options, Console console) {
    console.progress.begin("reading");
    const SceneJob job = read_scene_job(options.scene, options.output);
    check_target(options.output, job.files);
    const std::string& url = options.scene.server;
    const std::string picture =
        url.empty() ? render_here(job, options.scene.threads, console.progress)
                    : ask_server(url, "/v1/render", "image/", job, console.progress).body;
    console.progress.begin("writing");
    console.outputs.write(options.output, picture);
}

void scene_command(const Options& options, Console console) {
    console.progress.begin("reading");
    const SceneJob job = read_scene_job(options.scene, "");
    RemoteAnswer answer;
    if (options.scene.server.empty()) {
        (void)load_here(job, Executor(options.scene.threads), console.progress);
        answer = {job.text, server::picture_etag(job.text)};
    } else {
        answer = ask_server(options.scene.server, "/v1/scene", "application/json", job,
                            console.progress);
    }
    console.progress.end();
    write_to_stdout((options.etag ? answer.etag : server::indented(answer.body)) + "\n");
}

}  // namespace relit::cli
