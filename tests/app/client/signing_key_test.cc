#include "app/client/signing_key.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const std::string& hex) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return out;
}

template <typename Array>
Array array_of(const std::string& hex) {
  Array out{};
  const Bytes bytes = bytes_of(hex);
  std::copy(bytes.begin(), bytes.end(), out.begin());
  return out;
}

struct KnownAnswer {
  const char *seed, *key, *message, *signature;
};
// RFC 8032, 7.1, tests 1 to 3.
constexpr KnownAnswer kKnown[] = {{"9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60",
                                   "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a", "",
                                   "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb882159"
                                   "0a33bacc61e39701cf9b46bd25bf5f0"
                                   "595bbe24655141438e7a100b"},
                                  {"4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
                                   "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
                                   "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43"
                                   "e15996e458f3613d0f11d8c387b2eae"
                                   "b4302aeeb00d291612bb0c00"},
                                  {"c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
                                   "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
                                   "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538"
                                   "d16f290ae67f760984dc6594a7c15e9"
                                   "716ed28dc027beceea1ec40a"}};

TEST(SigningKey, SignsAsRfc8032Says) {
  for (const KnownAnswer& known : kKnown) {
    const SigningKey key("anna", array_of<SigningKey::Seed>(known.seed));
    EXPECT_EQ(key.public_key(), array_of<PublicKey>(known.key));
    const auto signature = array_of<Signature>(known.signature);
    EXPECT_EQ(key.sign(bytes_of(known.message)), signature);
    EXPECT_TRUE(is_signed_by(key.public_key(), bytes_of(known.message), signature));
    EXPECT_FALSE(is_signed_by(key.public_key(), bytes_of("00"), signature));
  }
}

// The base64 is that of the RFC's first key, by another program.
TEST(PublicKey, IsFortyFourCharactersAndNothingElse) {
  const std::string text = "11qYAYKxCrfVS/7TyWQHOg7hcvPapiMlrwIaaPcHURo=";
  const auto key = array_of<PublicKey>(kKnown[0].key);
  EXPECT_EQ(public_key_of(text), key);
  EXPECT_EQ(text_of(key), text);
  for (const std::string& bad :
       {std::string(), text.substr(1), text + "=", text.substr(0, 43), " " + text.substr(1),
        text.substr(0, 43) + "A", std::string("*") + text.substr(1)})
    EXPECT_FALSE(public_key_of(bad)) << bad;
}

class KeyFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "key-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path() const { return folder_ + "/anna.key"; }
  static std::string text_of_file(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string refusal() const {
    try {
      SigningKey::read(path());
    } catch (const KeyError& error) {
      return error.what();
    }
    return "";
  }
  std::string folder_;
};

TEST_F(KeyFile, IsForItsUserAloneAndNeverWrittenOver) {
  make_key_file(path(), "anna");
  struct stat info {};
  ASSERT_EQ(stat(path().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 07777u, 0600u);
  const std::string before = text_of_file(path());
  EXPECT_THROW(make_key_file(path(), "anna"), KeyError);
  EXPECT_EQ(text_of_file(path()), before);
  const SigningKey key = SigningKey::read(path());
  EXPECT_EQ(key.name(), "anna");
  EXPECT_TRUE(is_signed_by(key.public_key(), Bytes{1, 2}, key.sign(Bytes{1, 2})));
  EXPECT_EQ(before.find(text_of(key.public_key())), std::string::npos);
}

TEST_F(KeyFile, TwoPairsAreNotTheSame) {
  make_key_file(path(), "anna");
  make_key_file(path() + "2", "anna");
  EXPECT_NE(SigningKey::read(path()).public_key(), SigningKey::read(path() + "2").public_key());
}

TEST_F(KeyFile, ThatOthersCanReadOrWriteIsRefused) {
  make_key_file(path(), "anna");
  for (const mode_t mode : {0640u, 0604u, 0620u, 0602u, 0610u}) {
    ASSERT_EQ(chmod(path().c_str(), mode), 0);
    EXPECT_NE(refusal().find("chmod 600"), std::string::npos) << std::oct << mode;
  }
  ASSERT_EQ(chmod(path().c_str(), 0400), 0);
  EXPECT_EQ(refusal(), "");
}

TEST_F(KeyFile, OfAnotherUserOrBehindALinkIsRefused) {
  make_key_file(folder_ + "/real", "anna");
  std::filesystem::create_symlink(folder_ + "/real", path());
  EXPECT_NE(refusal().find("link"), std::string::npos);
  std::filesystem::remove(path());
  std::filesystem::rename(folder_ + "/real", path());
  if (geteuid() != 0 || chown(path().c_str(), 12345, 0) != 0)
    GTEST_SKIP() << "only root can give a file away";
  EXPECT_NE(refusal().find("another user"), std::string::npos);
}

TEST_F(KeyFile, WithAnythingElseInItIsRefused) {
  const std::string seed = "nWGxne/9WmC6hEr0kuwsxERJxWl7MmkZcDusAxyuf2A=";
  const auto write = [&](const std::string& text) {
    std::ofstream(path()) << text;
    chmod(path().c_str(), 0600);
  };
  write("name = \"anna\"\nprivate = \"" + seed + "\"\n");
  ASSERT_EQ(refusal(), "");
  EXPECT_EQ(SigningKey::read(path()).public_key(), array_of<PublicKey>(kKnown[0].key));
  for (const std::string& text : std::vector<std::string>{
           std::string(), "name = \"anna\"\n", "private = \"" + seed + "\"\n",
           "name = \"anna\"\nprivate = \"" + seed.substr(1) + "\"\n",
           "name = \"\"\nprivate = \"" + seed + "\"\n", "name = \"a b\"\nprivate = \"" + seed + "\"\n",
           "name = \"anna\"\nprivate = \"" + seed + "\"\nrole = \"look\"\n", std::string(5000, ' ')}) {
    write(text);
    EXPECT_NE(refusal(), "") << text;
    EXPECT_EQ(refusal().find(seed), std::string::npos) << "a message must not tell the key";
  }
}

TEST_F(KeyFile, OfAPrivateKeyIsNoPublicOne) {
  make_key_file(path(), "anna");
  EXPECT_THROW(read_public_key(path()), KeyError);
  std::ofstream(folder_ + "/anna.pub") << text_of(SigningKey::read(path()).public_key()) << "\nanna\n";
  EXPECT_EQ(read_public_key(folder_ + "/anna.pub"), SigningKey::read(path()).public_key());
  EXPECT_THROW(read_public_key(folder_ + "/none"), KeyError);
}

}  // namespace
}  // namespace trn
