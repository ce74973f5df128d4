#include "core/io/oiio.h"

#include <OpenImageIO/imageio.h>

namespace relit {

void configure_openimageio() {
    static const bool configured = [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", -1);  // 0 and 1 still start OpenEXR's own pool
        OIIO::attribute("try_all_readers", 0);
        return true;
    }();
    (void)configured;
}

}  // namespace relit
