// SPDX-License-Identifier: Apache-2.0
#include "fbvins/ros2/cdr_type.hpp"

#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace fbvins {
namespace {

constexpr std::size_t kAlignment = 4;  // DDS reads whole words; bytes beyond the end are undefined

struct Message : ddsi_serdata {
  std::string bytes;     ///< padded to whole words
  std::size_t size = 0;  ///< without padding
};

Message& as_message(ddsi_serdata* data) { return static_cast<Message&>(*data); }
const Message& as_message(const ddsi_serdata* data) { return static_cast<const Message&>(*data); }

Message* make(const ddsi_sertype* type, ddsi_serdata_kind kind, std::string bytes) {
  auto* message = new Message();
  ddsi_serdata_init(message, type, kind);
  message->hash = type->serdata_basehash;
  message->size = bytes.size();
  message->bytes = std::move(bytes);
  message->bytes.resize((message->size + kAlignment - 1) / kAlignment * kAlignment, '\0');
  return message;
}

ddsi_serdata* from_network(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment, std::size_t size) {
  std::string bytes(size, '\0');
  for (std::uint32_t done = 0; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= done) continue;  // overlaps what is there
    const unsigned char* payload = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    const std::size_t end = std::min<std::size_t>(fragment->maxp1, size);
    if (end > done) std::memcpy(bytes.data() + done, payload + (done - fragment->min), end - done);
    done = static_cast<std::uint32_t>(end);
  }
  return make(type, kind, std::move(bytes));
}

ddsi_serdata* from_parts(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t parts, const ddsrt_iovec_t* part,
                         std::size_t size) {
  std::string bytes;
  bytes.reserve(size);
  for (ddsrt_msg_iovlen_t k = 0; k < parts; ++k) {
    const auto length = std::min<std::size_t>(part[k].iov_len, size - bytes.size());
    bytes.append(static_cast<const char*>(part[k].iov_base), length);
  }
  return make(type, kind, std::move(bytes));
}

/// A topic without keys has one instance: all keys are equal and empty.
ddsi_serdata* from_keyhash(const ddsi_sertype* type, const ddsi_keyhash*) { return make(type, SDK_KEY, {}); }
ddsi_serdata* without_value(const ddsi_serdata* data) {
  Message* key = make(data->type, SDK_KEY, {});
  key->type = nullptr;
  return key;
}
bool same_key(const ddsi_serdata*, const ddsi_serdata*) { return true; }
void key_hash(const ddsi_serdata*, ddsi_keyhash* hash, bool) { *hash = {}; }

/// Conversions of samples are not used: the application writes and takes bytes (dds_writecdr, dds_takecdr).
ddsi_serdata* from_sample(const ddsi_sertype*, ddsi_serdata_kind, const void*) { return nullptr; }
bool to_sample(const ddsi_serdata*, void*, void**, void*) { return false; }
bool key_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return false; }

std::uint32_t size_of(const ddsi_serdata* data) { return static_cast<std::uint32_t>(as_message(data).size); }
void copy_out(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* to) {
  std::memcpy(to, as_message(data).bytes.data() + offset, size);
}
ddsi_serdata* lend(const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* part) {
  part->iov_base = const_cast<char*>(as_message(data).bytes.data() + offset);
  part->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(data);
}
void give_back(ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); }
void free_message(ddsi_serdata* data) { delete &as_message(data); }
std::size_t print(const ddsi_sertype* type, const ddsi_serdata* data, char* to, std::size_t size) {
  const int length = std::snprintf(to, size, "%s of %u bytes", type->type_name, size_of(data));
  return length < 0 ? 0 : static_cast<std::size_t>(length);
}

// Field by field, as the struct's fields depend on how CycloneDDS was built.
const ddsi_serdata_ops kMessageOperations = [] {
  ddsi_serdata_ops o{};
  o.eqkey = same_key;
  o.get_size = size_of;
  o.from_ser = from_network;
  o.from_ser_iov = from_parts;
  o.from_keyhash = from_keyhash;
  o.from_sample = from_sample;
  o.to_ser = copy_out;
  o.to_ser_ref = lend;
  o.to_ser_unref = give_back;
  o.to_sample = to_sample;
  o.to_untyped = without_value;
  o.untyped_to_sample = key_to_sample;
  o.free = free_message;
  o.print = print;
  o.get_keyhash = key_hash;
  return o;
}();

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}

const ddsi_sertype_ops kTypeOperations = [] {
  ddsi_sertype_ops o{};
  o.version = ddsi_sertype_v0;
  o.free = free_type;
  o.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  o.realloc_samples = [](void**, const ddsi_sertype*, void*, std::size_t, std::size_t) {};
  o.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  o.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };  // of types of the same name
  o.hash = [](const ddsi_sertype*) -> std::uint32_t { return 0; };
  return o;
}();

}  // namespace

ddsi_sertype* make_cdr_type(const std::string& type_name) {
  auto* type = new ddsi_sertype();
  ddsi_sertype_init(type, type_name.c_str(), &kTypeOperations, &kMessageOperations, true);
  return type;
}

ddsi_serdata* make_cdr_message(const ddsi_sertype& type, std::string bytes) { return make(&type, SDK_DATA, std::move(bytes)); }

std::string_view bytes_of(const ddsi_serdata& message) {
  const Message& m = as_message(&message);
  return std::string_view(m.bytes).substr(0, m.size);
}

}  // namespace fbvins
