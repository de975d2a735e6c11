#include "tests/drivers/recordings.hpp"

#include <boost/uuid/detail/md5.hpp>

namespace drivers_test {

std::string md5_hex(ByteView bytes) {
  boost::uuids::detail::md5 hash;
  if (!bytes.empty()) hash.process_bytes(bytes.data(), bytes.size());  // It copies from null else.
  boost::uuids::detail::md5::digest_type words;
  hash.get_digest(words);
  std::string text;
  for (const unsigned word : words)
    for (int byte = 0; byte < 4; ++byte)
      for (const int shift : {4, 0})
        text += "0123456789abcdef"[word >> (24 - 8 * byte + shift) & 15U];
  return text;
}

TEST(Recordings, DigestsAreMd5) {
  EXPECT_EQ(md5_hex({}), "d41d8cd98f00b204e9800998ecf8427e");
  EXPECT_EQ(md5_hex(drivers::as_bytes("abc")), "900150983cd24fb0d6963f7d28e17f72");
}

}  // namespace drivers_test
