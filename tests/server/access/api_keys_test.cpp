#include "server/access/api_keys.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace relit::server {
namespace {

const std::string first = "first-key-0123456789", second = "second/key+0123456789==";

std::string refusal_of(const std::string& text) {
    try {
        (void)parse_api_keys(text);
        return "accepted";
    } catch (const std::runtime_error& error) {
        return error.what();
    }
}

TEST(ApiKeys, ALineIsAKeyItsScopeAndMaybeItsName) {
    const KeyList keys = parse_api_keys("# keys of the gallery\n\n" + first +
                                        " render gallery\r\n\t" + second + "  admin\n");
    ASSERT_EQ(keys.size(), 2u);
    EXPECT_EQ(keys[0].secret, first);
    EXPECT_EQ(keys[0].scope, Scope::render);
    EXPECT_EQ(keys[0].name, "gallery");
    EXPECT_EQ(keys[1].secret, second);
    EXPECT_EQ(keys[1].scope, Scope::admin);
    EXPECT_EQ(keys[1].name, "line-4");
}

TEST(ApiKeys, WhatIsNoKeyIsRefusedByItsLineAndNotQuoted) {
    const std::string good = first + " read\n";
    EXPECT_NE(refusal_of("").find("no key"), std::string::npos);
    EXPECT_NE(refusal_of("# none\n").find("no key"), std::string::npos);
    for (const std::string& line :
         {std::string("short read"), std::string(257, 'k') + " read",
          std::string("sixteen-c{aracters read"), second, second + " reader",
          second + " read,admin", second + " read a,b", second + " read " + std::string(65, 'n'),
          second + " read name more", first + " admin"}) {
        const std::string refusal = refusal_of(good + line + "\n");
        EXPECT_TRUE(refusal.starts_with("line 2: ")) << line << " -> " << refusal;
        EXPECT_EQ(refusal.find(line.substr(0, 8)), std::string::npos) << refusal;
    }
    std::string many;
    for (int i = 0; i < 1001; ++i) many += "a-key-of-many-" + std::to_string(10000 + i) + " read\n";
    EXPECT_TRUE(refusal_of(many).starts_with("line 1001: "));
}

TEST(ApiKeys, AreFoundWholeAndExactly) {
    const KeyList keys = parse_api_keys(first + " read\n" + second + " admin\n");
    EXPECT_EQ(find_key(keys, second), &keys[1]);
    for (const std::string& sent :
         {std::string(), first.substr(1), first + "x", std::string("FIRST-KEY-0123456789"),
          keys[0].digest, std::string(100'000, 'x')})
        EXPECT_EQ(find_key(keys, sent), nullptr) << sent.substr(0, 40);
}

class KeyFile : public testing::Test {
protected:
    void write(const std::string& text,
               std::filesystem::perms mode = std::filesystem::perms(0600)) {
        std::filesystem::remove(path);
        std::ofstream(path) << text;
        std::filesystem::permissions(path, mode);
    }
    [[nodiscard]] std::string refusal() const {
        try {
            ApiKeys keys(path);
            return "accepted";
        } catch (const std::runtime_error& error) {
            return error.what();
        }
    }
    test::TemporaryFolder folder;
    std::filesystem::path path = folder.path() / "keys";
};

TEST_F(KeyFile, ThatOthersMayUseIsRefused) {
    for (const int mode : {0600, 0400, 0640, 0440}) {
        write(first + " read\n", std::filesystem::perms(mode));
        EXPECT_EQ(refusal(), "accepted") << std::oct << mode;
    }
    for (const int mode : {0644, 0604, 0660, 0666, 0602, 0601}) {
        write(first + " read\n", std::filesystem::perms(mode));
        EXPECT_NE(refusal().find("chmod 600"), std::string::npos) << std::oct << mode;
    }
}

TEST_F(KeyFile, ThatCannotBeReadIsNamed) {
    EXPECT_NE(refusal().find("--api-keys " + path.string() + ": cannot be read"),
              std::string::npos);
    std::filesystem::create_directory(path);
    EXPECT_NE(refusal().find("is no file"), std::string::npos);
    std::filesystem::remove(path);
    write(std::string(300'000, '#'));
    EXPECT_NE(refusal().find("larger than"), std::string::npos);
}

TEST_F(KeyFile, IsReadAgainWhenItChangesAndABrokenOneChangesNothing) {
    using namespace std::chrono_literals;
    write(first + " read\n");
    ApiKeys keys(path);
    const auto knows = [&](const std::string& key) {
        return find_key(*keys.current(), key) != nullptr;
    };
    const auto before = keys.current();
    write(first + " read\n" + second + " admin\n");
    std::this_thread::sleep_for(1100ms);
    EXPECT_TRUE(knows(first) && knows(second)) << "a second key beside the first";
    EXPECT_EQ(before->size(), 1u) << "who holds the list still has it";
    write(second + " adm\n");
    std::this_thread::sleep_for(1100ms);
    EXPECT_TRUE(knows(first) && knows(second)) << "a broken file";
    std::filesystem::remove(path);
    std::this_thread::sleep_for(1100ms);
    EXPECT_TRUE(knows(first) && knows(second)) << "no file";
    write(second + " admin\n");
    std::this_thread::sleep_for(1100ms);
    EXPECT_FALSE(knows(first)) << "the first is gone";
    EXPECT_TRUE(knows(second));
}

}  // namespace
}  // namespace relit::server
