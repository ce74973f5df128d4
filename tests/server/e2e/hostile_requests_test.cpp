// Requests made to hurt, against the real program: what each gets, and what it costs the server.
#include <chrono>

#include "tests/server/e2e/hostile_client.h"
#include "tests/support/base64.h"
#include "tests/support/encoded.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using HostileRequest = HostileClient;

const std::string plato = "c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908";

std::string times(int count, const std::string& text) {
    std::string result;
    for (int i = 0; i < count; ++i) result += text;
    return result;
}

std::string scene_with(const std::string& rest) {
    return R"({"height": {"image": ")" + plato + "\"}" + (rest.empty() ? "" : ", " + rest) + "}";
}

// 25 MB of zeros in 25 kB, as zlib packs them.
std::string zlib_bomb() {
    const std::string png = encoded(Image(5000, 5000, 1, 0.f));
    std::string packed;
    for (auto at = png.find("IDAT"); at != std::string::npos; at = png.find("IDAT", at)) {
        const auto byte = [&](std::size_t i) { return std::size_t(std::uint8_t(png[at - 4 + i])); };
        const std::size_t size = byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
        packed += png.substr(at + 4, size);
        at += 4 + size;
    }
    return packed;
}

TEST_F(HostileRequest, APackedBodyIsRefusedUnread) {
    const std::string bomb = zlib_bomb();
    EXPECT_GT(bomb.size(), 20'000u);
    EXPECT_LT(bomb.size(), 250'000u);
    for (const char* target : {"/v1/images", "/v1/render", "/v1/scene", "/v1/batches"})
        for (const char* coding : {"gzip", "deflate", "br", "zstd", "gzip, gzip"})
            expect_refused(send("POST", target, bomb, {{"Content-Encoding", coding}}), 415,
                           "/problems/unsupported-media-type");
}

TEST_F(HostileRequest, AFloodOfRangesGetsThePictureOnceAndWhole) {
    const std::string target = "/v1/images/" + plato + "/content";
    const std::size_t size = send("GET", target).body.size();
    EXPECT_EQ(size, 132446u);
    for (const std::string& ranges :
         {"bytes=0-" + times(2500, ",0-"), "bytes=0-0" + times(2500, ",1-1"),
          std::string("bytes=-99999999999999999999"), std::string("bytes=5-1"),
          "bytes=" + std::string(20'000, '9') + "-"})
        for (int i = 0; i < 10; ++i) {
            const HttpReply reply = send("GET", target, "", {{"Range", ranges}});
            EXPECT_EQ(reply.status, 200) << ranges.substr(0, 40);
            EXPECT_EQ(reply.body.size(), size) << ranges.substr(0, 40);
        }
}

// Each is sent before two requests that would be answered if any of its bytes were taken for theirs.
TEST_F(HostileRequest, ChunksThatTwoReadersCouldReadDifferentlyEndTheConnection) {
    const std::string body = scene_with("");
    char size[20];
    std::snprintf(size, sizeof size, "%zx", body.size());
    const std::string hex = size, data = "\r\n" + body + "\r\n", end = "0\r\n\r\n";
    const std::string next = "GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n";
    const auto send_chunks = [&](RawConnection& connection, const std::string& chunks) {
        connection.send("POST /v1/scene HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n" +
                        chunks + next + next);
    };
    for (const std::string& chunks :
         {"0x" + hex + data + end, "+" + hex + data + end, " " + hex + data + end,
          hex + " " + data + end, hex + "zz" + data + end, hex + "\t" + data + end,
          hex + std::string(1, '\0') + data + end, std::string(40, '0') + hex + data + end,
          "10000000000000000" + hex + data + end, hex + "\n" + body + "\r\n" + end,
          hex + "\r\n" + body + "\n" + end, hex + "\r\n" + body + end, hex + data + "-0\r\n\r\n",
          hex + data + "0\n\r\n", hex + ";\n" + body + "\r\n" + end,
          hex + ";" + std::string(100'000, 'a') + data + end,
          hex + data + "0\r\n" + times(100'000, "A: b\r\n") + "\r\n"}) {
        RawConnection connection(relitd->port());
        send_chunks(connection, chunks);
        expect_refused(connection.receive(), 400, "chunks are broken");
        EXPECT_TRUE(connection.ends_within(1500ms)) << chunks.substr(0, 60);
    }
    RawConnection connection(relitd->port());
    send_chunks(connection, hex + ";a=b" + data + "0\r\nX: y\r\n\r\n");
    for (int i = 0; i < 3; ++i) EXPECT_EQ(connection.receive().status, 200) << "these are sound";
}

TEST_F(HostileRequest, PathsLeadNowhereElse) {
    for (const std::string path :
         {"/../../../../etc/passwd", "/v1/images/../../../../etc/passwd", "/..", "/./healthz",
          "/%2e%2e/%2e%2e/etc/passwd", "/v1/images/%2e%2e/content", "/v1/images/./content",
          "/v1/images/%252e%252e%252fetc%252fpasswd/content", "//etc/passwd", "/healthz/",
          "/v1/images/C:/content", "/HEALTHZ", "/v1/batches/%2e%2e/frames/0", "/studio/../main.cpp",
          "/v1/images/~root/content", "/healthz;a=b", "/file:///etc/passwd"})
        expect_refused(send("GET", path), 404, "/problems/not-found");
    for (const std::string path : {"/%5c..%5cwindows", "/%", "/%zz", "/a%0d%0ab", "/%ff"})
        expect_refused(send("GET", path), 400, "/problems/malformed-request");
    expect_refused(send("GET", "/" + std::string(8000, 'a')), 404, "/problems/not-found");
    expect_refused(send("GET", "/" + times(2600, "%61")), 404, "/problems/not-found");
}

TEST_F(HostileRequest, NothingOfItBecomesAHeaderOfTheReply) {
    const std::string evil = "x\r\nX-Injected: 1";
    const std::string target = "/v1/images/" + plato;
    for (const char* name : {"Origin", "Relit-Session", "Idempotency-Key", "If-None-Match",
                             "X-Request-Id", "Traceparent", "Accept"}) {
        RawConnection raw(relitd->port());  // CR LF is the end of a header, whatever was meant
        raw.send("GET " + target + " HTTP/1.1\r\nHost: a\r\n" + name + ": " + evil + "\r\n\r\n");
        EXPECT_EQ(raw.receive().headers.count("x-injected"), 0u) << name;
        for (const char control : {'\n', '\r', '\0', '\v'}) {
            RawConnection bare(relitd->port());
            bare.send("GET " + target + " HTTP/1.1\r\nHost: a\r\n" + name + ": x" + control +
                      "X-Injected: 1\r\n\r\n");
            expect_refused(bare.receive(), 400, "/problems/malformed-request");
        }
        const HttpReply encoded = send("GET", target, "", {{name, "x%0d%0aX-Injected:%201"}});
        EXPECT_EQ(encoded.headers.count("x-injected"), 0u) << name;
    }
    const HttpReply query = send("GET", "/v1/version?a=b%0d%0aX-Injected:1");
    EXPECT_EQ(query.headers.count("x-injected"), 0u);
}

std::string part(const std::string& head, const std::string& content) {
    return "--b\r\n" + head + "\r\n\r\n" + content + "\r\n";
}

TEST_F(HostileRequest, FormsThatAbuseTheirFormAreRefused) {
    allowed_mib = 80;  // one of them has 16 MB, held once, and is refused after
    const std::string name = "Content-Disposition: form-data; name=";
    const struct {
        const char* what;
        int status;
        std::string body;
    } forms[] = {
        {"as many parts as fit", 413, times(100'000, part(name + "a", "")) + "--b--"},
        {"names that are there twice", 422,
         part(name + "scene", scene_with("")) + part(name + "scene", scene_with("")) + "--b--"},
        {"a head without end", 413, "--b\r\n" + std::string(16 << 20, 'a')},
        {"heads of many lines", 413, "--b\r\n" + times(1'000'000, "A: b\r\n") + "\r\nx\r\n--b--"},
        {"nothing but boundaries", 400, times(1'000'000, "--b\r\n")},
        {"nothing but beginnings of boundaries", 400, times(1'000'000, "\r\n--")},
        {"no end", 400, part(name + "scene", scene_with(""))},
        {"a form in a form", 400,
         part(name + "scene\r\nContent-Type: multipart/mixed; boundary=c",
              "--c\r\n\r\n{}\r\n--c--") +
             "--b--"},
        {"a part that nothing names", 422,
         part(name + "scene", scene_with("")) + part(name + "more; filename=a", "x") + "--b--"},
        {"a file's name that goes elsewhere", 422,
         part(name + "scene", scene_with("")) +
             part(name + R"("../../a"; filename="../../../etc/passwd")", "x") + "--b--"},
        {"a name with a null", 422,
         part(name + "scene", scene_with("")) +
             part(name + "\"a" + std::string(1, '\0') + "b\"", "x") + "--b--"},
        {"no parts", 422, "--b--"},
    };
    for (const auto& form : forms) {
        SCOPED_TRACE(form.what);
        const auto start = std::chrono::steady_clock::now();
        const HttpReply reply = send("POST", "/v1/render", form.body,
                                     {{"Content-Type", "multipart/form-data; boundary=b"}});
        expect_refused(reply, form.status, "/problems/");
        EXPECT_LT(std::chrono::steady_clock::now() - start, 3s);
    }
    for (const std::string type :
         {"multipart/form-data", "multipart/form-data; boundary=",
          "multipart/form-data; boundary=\"", "multipart/form-data; boundary=a; boundary=b"})
        EXPECT_EQ(send("POST", "/v1/render", forms[0].body, {{"Content-Type", type}}).status, 400)
            << type;
}

TEST_F(HostileRequest, JsonThatAbusesItsFormIsRefusedWhereverItComesFrom) {
    const std::string deep = R"({"height": )" + std::string(200'000, '[');
    const std::string twice = R"({"relief": 1, "relief": 1})";
    const std::string broken = "{\"height\": {\"image\": \"\xc0\xaf\xff\"}}";
    const std::string flood = "{\"lights\": [" + times(1'100'000, "0,0,") + "0]}";
    for (const char* target : {"/v1/render", "/v1/scene", "/v1/batches"}) {
        expect_refused(send("POST", target, deep), 400, "max-json-depth");
        expect_refused(send("POST", target, twice), 422, "/problems/duplicate-field");
        expect_refused(send("POST", target, broken), 400, "/problems/malformed-json");
    }
    allowed_mib = 160;  // two million numbers, before the limit says that they are too many
    expect_refused(send("POST", "/v1/scene", flood), 400, "max-json-values");
    const auto in_query = [&](const std::string& json) {
        return send("GET", "/v1/render?scene=" + encode_base64url(json));
    };
    expect_refused(in_query(deep.substr(0, 10'000)), 400, "max-json-depth");
    expect_refused(in_query(twice), 422, "/problems/duplicate-field");
    expect_refused(in_query(broken), 400, "/problems/malformed-json");
    const std::string flat = "/v1/images/" + plato + "/relit.png?";
    expect_refused(send("GET", flat + "lights=" + times(5000, "%5b")), 400, "max-json-depth");
    expect_refused(send("GET", flat + "lights" + times(5000, ".0") + "=1"), 422,
                   "so many segments");
    expect_refused(send("GET", flat + "lights.999999999.intensity=1"), 422, "/problems/");
    expect_refused(send("GET", flat + "relief=1&relief=1"), 422, "/problems/duplicate-field");
    expect_refused(send("GET", flat + "relief=%c0%af"), 400, "/problems/malformed-request");
}

TEST_F(HostileRequest, NumbersThatAreNoneOrTooLargeAreRefusedByTheirField) {
    for (const std::string number : {"1e38", "-1e38", "1e308", "1e400", "-1e400"}) {
        expect_refused(send("POST", "/v1/scene", scene_with("\"relief\": " + number)), 422,
                       "relief");
        const std::string position = R"("light": {"type": "point", "position": [0, 0, )" + number;
        expect_refused(send("POST", "/v1/scene", scene_with(position + "]}")), 422,
                       "light.position");
    }
    for (const char* word : {"NaN", "nan", "Infinity", "-Infinity", "inf", "0x10", "1e", "--1"}) {
        expect_refused(send("POST", "/v1/scene", scene_with("\"relief\": " + std::string(word))),
                       400, "/problems/malformed-json");
        const std::string flat = "/v1/images/" + plato + "/relit.png?relief=" + word;
        expect_refused(send("GET", flat), 422, "'relief'");
    }
}

TEST_F(HostileRequest, AbsurdScenesAreRefusedBeforeWorkIsDone) {
    const std::string light = R"({"type": "point"},)";
    const std::string lights = "\"lights\": [" + times(63, light) + R"({"type": "point"}])";
    const std::string more = "\"lights\": [" + times(64, light) + R"({"type": "point"}])";
    const struct {
        int status;
        const char* says;
        std::string rest;
    } scenes[] = {
        {422, "max-output-pixels", R"("output": {"width": 32768, "height": 32768})"},
        {422, "output.width", R"("output": {"width": 2147483648})"},
        {422, "output.region", R"("output": {"region": [2147483647, 0, 2147483647, 1]})"},
        {422, "output.region", R"("output": {"region": [-1, 0, 10, 10]})"},
        {422, "max-lights", more},
        {422, "max-scene-cost",
         lights + R"(, "material": {"illumination": "count", "steps": 10000})"},
    };
    for (const auto& scene : scenes) {
        const auto start = std::chrono::steady_clock::now();
        expect_refused(send("POST", "/v1/render", scene_with(scene.rest)), scene.status,
                       scene.says);
        EXPECT_LT(std::chrono::steady_clock::now() - start, 1s) << scene.says;
    }
}

}  // namespace
}  // namespace relit::test
