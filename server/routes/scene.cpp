#include "server/routes/scene.h"

#include "server/routes/render_request.h"
#include "server/scenes/picture_etag.h"
#include "server/scenes/scene_loading.h"

namespace relit::server {

Reply check_scene(const Request& request, Services& services) {
    const RenderRequest job = parse_render_request(request, services.limits);
    const FindImage find = find_in(job, services.images);
    {
        // Nothing is rendered: it waits beside the uploads, not behind the renders.
        const auto slot = services.decodes.wait_for_slot(request.deadline, request.client_gone);
        const auto decode = [&](std::string_view bytes) {
            return services.decoder.decode(bytes, {request.client_gone, request.deadline});
        };
        (void)load_scene(job.scene, find, decode, services.limits, services.executor,
                         services.cache);
    }
    Reply reply{.content_type = "application/json", .body = job.scene_text};
    reply.headers["Cache-Control"] = "no-store";
    if (job.scene.output.picture.accuracy == Accuracy::final)
        reply.headers["ETag"] = picture_etag(job.scene_text);
    return reply;
}

}  // namespace relit::server
