// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/safetensors.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace fbvins {
namespace safetensors_test {

std::string file_of(const std::string& header, const std::string& data) {
  const std::uint64_t length = header.size();
  std::string bytes(8, '\0');
  std::memcpy(bytes.data(), &length, 8);
  return bytes + header + data;
}

std::string floats(std::initializer_list<float> values) {
  std::string out;
  for (const float v : values) out.append(reinterpret_cast<const char*>(&v), 4);
  return out;
}

std::string error_of(const std::string& bytes) {
  const auto file = parse_safetensors(bytes);
  return file ? "" : file.error().message;
}

TEST(SafeTensors, ReadsSinglesHalvesAndMetadata) {
  const std::string header =
      R"({"__metadata__":{"format":"x \"y\""},"a":{"dtype":"F32","shape":[2,1],"data_offsets":[0,8]}, "h":{"dtype":"F16","shape":[3],"data_offsets":[8,14]}} )";
  const auto file = parse_safetensors(file_of(header, floats({1.5f, -2.0f}) + std::string("\x00\x3c\x00\xc0\x01\x00", 6)));
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->metadata.at("format"), "x \"y\"");
  EXPECT_EQ(file->tensors.at("a").shape, (std::vector<int>{2, 1}));
  EXPECT_EQ(file->tensors.at("a").values, (std::vector<float>{1.5f, -2.0f}));
  EXPECT_EQ(file->tensors.at("h").values, (std::vector<float>{1.0f, -2.0f, 0x1p-24f}));
}

TEST(SafeTensors, SaysWhatIsWrongWithADamagedFile) {
  const std::string good = R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})";
  EXPECT_EQ(error_of("abc"), "the file is too short for a header");
  EXPECT_EQ(error_of(file_of(good, floats({1}))), "tensor \"a\" ends at byte 8 of 4: the file is cut off");
  EXPECT_EQ(error_of(file_of(good, floats({1, std::nanf("")}))), "tensor \"a\" holds a number that is not finite");
  EXPECT_EQ(error_of(file_of(R"({"a":{"dtype":"F32","shape":[3],"data_offsets":[0,8]}})", floats({1, 2}))),
            "data_offsets of tensor \"a\" do not span the 12 bytes of its shape");
  EXPECT_EQ(error_of(file_of(R"({"a":{"dtype":"I64","shape":[1],"data_offsets":[0,8]}})", floats({1, 2}))),
            "tensor \"a\" has type \"I64\", not F32 or F16");
  EXPECT_EQ(error_of(file_of(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]})", "")),
            "the header is not valid near byte 54")
      << "its last brace is missing";
  EXPECT_EQ(error_of(file_of(good, "")), "tensor \"a\" ends at byte 8 of 0: the file is cut off");
  EXPECT_EQ(error_of(file_of(R"({"a":[1,2]})", "")), "\"a\" is not valid in the header");
  EXPECT_EQ(error_of(file_of(good.substr(0, 20), "")), "the header is not valid near byte 21");
  std::string long_header = file_of(good, floats({1, 2}));
  long_header[6] = '\x7f';
  EXPECT_NE(error_of(long_header).find("by its length field"), std::string::npos);
}

TEST(SafeTensors, IsStricterThanJson) {
  const std::string two = floats({1, 2});
  const auto with = [&](const std::string& entry) { return error_of(file_of("{\"a\":" + entry + "}", two)); };
  const std::string entry = R"({"dtype":"F32","shape":[2],"data_offsets":[0,8]})", invalid = "\"a\" is not valid in the header";
  ASSERT_EQ(with(entry), "");
  EXPECT_EQ(with(entry + ",\"a\":" + entry), "\"a\" appears twice in the header");
  EXPECT_EQ(with(R"({"dtype":"F32","dtype":"F32","shape":[2],"data_offsets":[0,8]})"), "\"dtype\" appears twice in the header");
  EXPECT_EQ(with(R"({"dtype":"F32","shape":[2],"data_offsets":[0,8],"more":1})"), invalid);
  for (const char* side : {"-2", "2.0", "2e0", "\"2\"", "1099511627777", "99999999999999999999", "null"})
    EXPECT_EQ(with(fmt::format(R"({{"dtype":"F32","shape":[{}],"data_offsets":[0,8]}})", side)), invalid) << side;
  EXPECT_EQ(error_of(file_of(R"({"__metadata__":{"a":1}})", "")), "\"__metadata__\" is not valid in the header");
  EXPECT_EQ(error_of(file_of("{}", "")), "the header names no tensors");
  EXPECT_EQ(error_of(file_of("[]", "")), "the header names no tensors");
  const std::string deep = std::string(1 << 19, '[') + std::string(1 << 18, ']');
  EXPECT_NE(error_of(file_of(deep, "")), "") << "deep nesting is an error, not a crash";
  EXPECT_EQ(with(R"({"dtype":"F32","shape":[[2]],"data_offsets":[0,8]})"), "the header is nested too deeply");
  EXPECT_EQ(with("[[[[1]]]]"), "the header is nested too deeply");
  EXPECT_EQ(with(std::string(1 << 18, '[') + std::string(1 << 18, ']')), "the header is nested too deeply");
}

TEST(SafeTensors, NamesTheFileThatIsMissing) {
  const auto file = read_safetensors("no/such.safetensors");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().message, "no/such.safetensors: cannot be opened");
}

TEST(SafeTensors, TurnsHalvesIntoSingles) {
  EXPECT_EQ(half_to_float(0x3555), 0.333251953125f);
  EXPECT_EQ(half_to_float(0x7bff), 65504.0f);
  EXPECT_EQ(half_to_float(0x8001), -0x1p-24f);
  EXPECT_TRUE(std::isinf(half_to_float(0x7c00)));
}

}  // namespace safetensors_test
}  // namespace fbvins
