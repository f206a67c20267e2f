// SPDX-License-Identifier: Apache-2.0
#include "fbvins/bags/whole_pages.hpp"

#include <sqlite3.h>

namespace fbvins {
namespace {

constexpr const char* kName = "fbvins-whole-pages";
constexpr int kPageSizeAt_bytes = 16;  // of the file: two bytes, the higher one first; 1 is 65536

sqlite3_vfs* base = nullptr;
const sqlite3_io_methods* base_methods = nullptr;

int whole_size(sqlite3_file* file, sqlite3_int64* size) {
  const int result = base_methods->xFileSize(file, size);
  unsigned char bytes[2] = {0, 0};
  if (result != SQLITE_OK || *size < kPageSizeAt_bytes + 2) return result;
  if (base_methods->xRead(file, bytes, 2, kPageSizeAt_bytes) != SQLITE_OK) return result;
  const sqlite3_int64 page = bytes[0] == 0 && bytes[1] == 1 ? 65536 : bytes[0] * 256 + bytes[1];
  if (page >= 512) *size -= *size % page;
  return SQLITE_OK;
}

int open_whole(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* flags_out) {
  const int result = base->xOpen(base, name, file, flags, flags_out);
  if (result != SQLITE_OK || (flags & SQLITE_OPEN_MAIN_DB) == 0) return result;
  static const sqlite3_io_methods methods = [&] {
    base_methods = file->pMethods;
    sqlite3_io_methods changed = *base_methods;
    changed.xFileSize = whole_size;
    return changed;
  }();
  if (file->pMethods == base_methods) file->pMethods = &methods;
  return result;
}

}  // namespace

const char* whole_pages_vfs() {
  static const bool there = [] {
    base = sqlite3_vfs_find(nullptr);
    if (base == nullptr) return false;
    static sqlite3_vfs own = *base;
    own.zName = kName;
    own.pNext = nullptr;
    own.xOpen = open_whole;
    return sqlite3_vfs_register(&own, 0) == SQLITE_OK;
  }();
  return there ? kName : nullptr;
}

}  // namespace fbvins
