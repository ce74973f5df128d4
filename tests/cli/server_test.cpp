// relit --server: the same pictures, few bytes on the way, patience with bounds.
#include <gtest/gtest.h>

#include "tests/cli/support/cli_folder.h"
#include "tests/cli/support/scripted_server.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using Requests = std::vector<std::string>;

class CliServer : public CliFolder {
protected:
    CliServer() { write("map.png", small_png()); }
    Ran render(const std::string& url, const std::string& flags = "-o a.png") const {
        return run("relit render map.png " + flags + " --server " + url);
    }
    // The id of map.png, from what was asked about it.
    static std::string id_in(const Requests& requests) {
        const std::string head = "HEAD /v1/images/";
        for (const std::string& request : requests)
            if (request.starts_with(head)) return request.substr(head.size());
        return "";
    }
};

std::string problem(const std::string& code, const std::string& detail,
                    const std::string& pointer = "") {
    return R"({"type":"/problems/)" + code + R"(","title":"T","status":1,"detail":")" + detail +
           '"' + (pointer.empty() ? "" : R"(,"pointer":")" + pointer + '"') + "}";
}

std::string picture_reply(const std::string& picture) {
    return http_reply("200 OK", picture, "Content-Type: image/png");
}

TEST_F(CliServer, GivesTheSameBytesAsThisMachine) {
    const RelitProcess relitd;
    const std::string url = "http://127.0.0.1:" + std::to_string(relitd.port());
    for (const std::string flags : {"sample:plato -o OUT.jpg --sun 300,30 --size 200",
                                    "map.png -o OUT.exr --env sample:rainbow,30 --alpha map.png",
                                    "sample:st-helens -o OUT.webp --set relief=0.3 --size x90"}) {
        const auto rendered = [&](const std::string& name, const std::string& more) {
            std::string command = "relit render " + flags + more;
            command.replace(command.find("OUT"), 3, name);
            const Ran ran = run(command);
            EXPECT_EQ(ran.status, 0) << command << '\n' << ran.err;
            return command.substr(command.find(name), name.size() + 5);
        };
        const auto file = [](const std::string& text) { return text.substr(0, text.find(' ')); };
        const std::string here = file(rendered("here", "")),
                          there = file(rendered("there", " --server " + url));
        EXPECT_GT(read(here).size(), 100u);
        EXPECT_EQ(read(here), read(there)) << flags;
    }
    for (const char* etag : {"", " --etag"}) {
        const std::string command = std::string("relit scene map.png --preset wax") + etag;
        const Ran here = run(command);
        const Ran there = run(command + " --server " + url);
        EXPECT_EQ(here.out, there.out) << there.err;
        EXPECT_EQ(there.status, 0);
    }
}

TEST_F(CliServer, SaysTheSameSentencesAsThisMachine) {
    const RelitProcess relitd({.flags = {"--max-image-bytes=2000"}});
    const std::string url = "http://127.0.0.1:" + std::to_string(relitd.port());
    write("cut.png", small_png().substr(0, 60));
    for (const std::string flags :
         {"map.png --set output.region=[0,0,99,1]", "map.png --albedo cut.png"}) {
        const Ran here = run("relit render -o a.png " + flags);
        const Ran there = run("relit render -o a.png " + flags + " --server " + url);
        EXPECT_EQ(here.status, 1);
        EXPECT_EQ(there.status, 1);
        EXPECT_EQ(here.err, there.err);
    }
    write("large.png", small_png(1, 200, 200));
    const Ran large = run("relit render large.png -o a.png --server " + url);
    EXPECT_EQ(large.status, 1);
    EXPECT_NE(large.err.find("max-image-bytes"), std::string::npos) << large.err;
    const Ran unknown = render(url, "-o a.png --set albedo.image=" + std::string(64, 'a'));
    EXPECT_EQ(unknown.status, 1);
    EXPECT_NE(unknown.err.find("there is no image with this id"), std::string::npos) << unknown.err;
}

TEST_F(CliServer, UploadsOnlyWhatIsMissing) {
    const std::string picture = "a picture";
    const ScriptedServer lacking(
        {http_reply("404 Not Found"), http_reply("201 Created", "{}"), picture_reply(picture)});
    EXPECT_EQ(render(lacking.url() + "/base/").status, 0);
    const Requests asked = lacking.requests();
    ASSERT_EQ(asked.size(), 3u);
    EXPECT_EQ(asked[0].substr(0, 21), "HEAD /base/v1/images/");
    EXPECT_EQ(asked[1], "POST /base/v1/images");
    EXPECT_EQ(asked[2], "POST /base/v1/render");
    EXPECT_EQ(read("a.png"), picture);
    const ScriptedServer having({http_reply("200 OK"), picture_reply(picture)});
    EXPECT_EQ(render(having.url()).status, 0);
    EXPECT_EQ(having.requests(),
              (Requests{"HEAD /v1/images/" + id_in(having.requests()), "POST /v1/render"}));
}

TEST_F(CliServer, AsksAgainWhenItIsToldToAndSaysSo) {
    const std::string busy =
        http_reply("503 Service Unavailable", problem("queue-full", "All places are taken."),
                   "Retry-After: 1");
    const ScriptedServer server({http_reply("200 OK"), busy, picture_reply("a picture")});
    const Ran ran = render(server.url());
    EXPECT_EQ(ran.status, 0);
    EXPECT_EQ(ran.err, "relit: all places are taken; trying again in 1 s (1 of 8)\n");
    const ScriptedServer later(
        {http_reply("200 OK"),
         http_reply("429 Too Many Requests", problem("rate", "Too many."), "Retry-After: 3600")});
    const Ran refused = render(later.url());
    EXPECT_EQ(refused.status, 1);
    EXPECT_EQ(refused.err, "relit: too many\n");
}

TEST_F(CliServer, AsksAgainWhileTheImagesInItsStorageAreInUse) {
    const std::string full =
        http_reply("507 Insufficient Storage", problem("storage-full", "There is no room left."));
    const ScriptedServer server({http_reply("404 Not Found"), full, http_reply("201 Created", "{}"),
                                 picture_reply("a picture")});
    const Ran ran = render(server.url());
    EXPECT_EQ(ran.status, 0);
    EXPECT_EQ(ran.err, "relit: there is no room left; trying again in 1 s (1 of 8)\n");
    EXPECT_EQ(read("a.png"), "a picture");
}

TEST_F(CliServer, SendsAnImageAgainThatTheServerForgot) {
    const std::string gone =
        http_reply("404 Not Found", problem("not-found", "Upload it.", "/height/image"));
    const ScriptedServer server({http_reply("200 OK"), gone, http_reply("404 Not Found"),
                                 http_reply("201 Created", "{}"), picture_reply("again")});
    EXPECT_EQ(render(server.url()).status, 0);
    EXPECT_EQ(server.requests().size(), 5u);
    EXPECT_EQ(read("a.png"), "again");
    const ScriptedServer never({http_reply("200 OK"), gone, http_reply("404 Not Found"),
                                http_reply("201 Created", "{}"), gone});
    const Ran ran = render(never.url());
    EXPECT_EQ(ran.status, 1);
    EXPECT_EQ(ran.err, "relit: map.png: upload it\n");
}

TEST_F(CliServer, SaysWhenThereIsNoneOrAnother) {
    const Ran none = render("http://127.0.0.1:1");
    EXPECT_EQ(none.status, 3);
    EXPECT_TRUE(none.err.starts_with("relit: http://127.0.0.1:1: cannot be reached: ")) << none.err;
    const ScriptedServer other({http_reply("200 OK"),
                                http_reply("200 OK", "<html>", "Content-Type: text/html"),
                                http_reply("200 OK"), http_reply("500 Oops", "<html>")});
    EXPECT_EQ(render(other.url()).err,
              "relit: " + other.url() + " answers 'text/html', as no Relit server does\n");
    EXPECT_EQ(render(other.url()).err,
              "relit: " + other.url() + " answers 500, as no Relit server does\n");
}

TEST_F(CliServer, BlamesTheUrlForAPathThatIsNotThere) {
    const RelitProcess relitd;
    const std::string url = "http://127.0.0.1:" + std::to_string(relitd.port()) + "/foo";
    const std::string words = " is no Relit server: it answers ";
    const std::string id(64, 'a');
    write("stored.json", R"({"height": {"image": ")" + id + R"("}})");
    for (const std::string inputs : {"map.png", "--scene stored.json"}) {
        const Ran ran = run("relit render -o a.png " + inputs + " --server " + url);
        EXPECT_EQ(ran.status, 1);
        EXPECT_EQ(ran.err, "relit: " + url + words + "404\n");
    }
    const ScriptedServer files({http_reply("405 Method Not Allowed")});
    EXPECT_EQ(render(files.url()).err, "relit: " + files.url() + words + "405\n");
}

}  // namespace
}  // namespace relit::test
