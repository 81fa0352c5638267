//! The result store of a sweep: an SQLite file that a kill at any moment leaves whole.
//!
//! ```text
//! meta         key, value                          which space, version, shard
//! evaluations  hash -> counters | error            a board in a workload, found again by any sweep that asks for it
//! accuracies   hash -> misclassified, rmse | error number formats in a workload
//! points       ordinal -> status, error, parameters and metrics as JSON: the sweep itself
//! ```
//! An evaluation's hash is BLAKE3 of the board (without its name), the settings that the workload's rays depend on (the
//! scene's own hash among them), how much of it ran, and the version: what is in the store needs no second run, and
//! nothing else is taken for it. Each evaluation is one transaction, in write-ahead logging, so that others can read
//! meanwhile; only one process writes, which holds the lock of the file beside.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use rtl_model::spec::BoardSpec;
use rusqlite::{Connection, OptionalExtension, params};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::evaluate::{Accuracy, Counted, Extent};
use crate::recorded::Setting;

/// Layout of the tables.
const LAYOUT: &str = "1";

/// Part of every evaluation's hash: what an evaluation depends on beside its inputs.
pub fn version() -> String {
    format!("radeng {}, board model {}", env!("CARGO_PKG_VERSION"), rtl_model::MODEL_VERSION)
}

const TABLES: &str = "
    CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS evaluations (hash TEXT PRIMARY KEY, counted BLOB, error TEXT) WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS accuracies (hash TEXT PRIMARY KEY, accuracy BLOB, error TEXT) WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS points (ordinal INTEGER PRIMARY KEY, status TEXT NOT NULL, error TEXT,
        parameters TEXT NOT NULL, metrics TEXT NOT NULL);
";

/// A store that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// What SQLite says.
    #[error("{file}: {source}", file = .file.display())]
    Sqlite {
        /// The store.
        file: PathBuf,
        /// Why.
        source: rusqlite::Error,
    },
    /// It is of other use.
    #[error("{file}: {what}", file = .file.display())]
    Other {
        /// The store.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// An open store.
#[derive(Debug)]
pub struct Store {
    file: PathBuf,
    connection: Connection,
    /// Held while the store is open for writing.
    _lock: Option<File>,
}

/// A point as it is in the store.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredPoint {
    /// Its place in the full grid.
    pub ordinal: u64,
    /// `simulated`, `sampled`, `shortened`, `pruned`, `impossible`, `failed`.
    pub status: String,
    /// Of a failed or impossible one.
    pub error: Option<String>,
}

impl Store {
    /// Opens the store in `file`, or makes it; nobody else may write to it.
    ///
    /// # Errors
    /// A file that is no such store, or that another process writes to.
    pub fn open(file: &Path) -> Result<Store, StoreError> {
        let lock = Self::lock(file)?;
        Self::with(Connection::open(file), file, Some(lock))
    }

    /// The lock of a store, which the system takes back when its process ends, however it does.
    fn lock(file: &Path) -> Result<File, StoreError> {
        let other = |what: String| StoreError::Other { file: file.to_owned(), what };
        let path = file.with_extension("lock");
        let lock = File::options().create(true).truncate(false).write(true).open(&path);
        let lock = lock.map_err(|e| other(format!("cannot make {}: {e}", path.display())))?;
        match lock.try_lock() {
            Ok(()) => Ok(lock),
            Err(TryLockError::WouldBlock) => Err(other("another sweep is writing to this store".to_owned())),
            Err(TryLockError::Error(e)) => Err(other(format!("cannot lock {}: {e}", path.display()))),
        }
    }

    /// Opens a finished store for reading.
    ///
    /// # Errors
    /// As [`Store::open`], and a file that is not there.
    pub fn read(file: &Path) -> Result<Store, StoreError> {
        let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_WRITE | rusqlite::OpenFlags::SQLITE_OPEN_NO_MUTEX;
        Self::with(Connection::open_with_flags(file, flags), file, None)
    }

    fn with(
        connection: rusqlite::Result<Connection>,
        file: &Path,
        lock: Option<File>,
    ) -> Result<Store, StoreError> {
        let opening = |source| Self::opening(file, source);
        let connection = connection.map_err(opening)?;
        connection
            .query_row("PRAGMA journal_mode = WAL", [], |_| Ok(()))
            .and_then(|()| {
                connection.execute_batch("PRAGMA synchronous = NORMAL; PRAGMA busy_timeout = 10000;")
            })
            .map_err(opening)?;
        let is_made = lock.is_some();
        let store = Store { file: file.to_owned(), connection, _lock: lock };
        if is_made {
            store.connection.execute_batch(TABLES).map_err(opening)?;
            if store.meta("layout")?.is_none() {
                store.set_meta("layout", LAYOUT)?;
            }
        }
        match store.meta("layout")? {
            Some(layout) if layout == LAYOUT => Ok(store),
            found => Err(store.other(format!(
                "its tables are of layout {}, expected {LAYOUT}",
                found.unwrap_or_else(|| "none".to_owned())
            ))),
        }
    }

    fn opening(file: &Path, source: rusqlite::Error) -> StoreError {
        let file = file.to_owned();
        match source.sqlite_error_code() {
            Some(rusqlite::ErrorCode::NotADatabase) => {
                StoreError::Other { file, what: "not a result store: no SQLite file".to_owned() }
            }
            _ => StoreError::Sqlite { file, source },
        }
    }

    /// An error about this store.
    pub fn other(&self, what: String) -> StoreError {
        StoreError::Other { file: self.file.clone(), what }
    }

    fn fault(&self, source: rusqlite::Error) -> StoreError {
        StoreError::Sqlite { file: self.file.clone(), source }
    }

    /// A note about the sweep.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn meta(&self, key: &str) -> Result<Option<String>, StoreError> {
        self.connection
            .query_row("SELECT value FROM meta WHERE key = ?1", [key], |row| row.get(0))
            .optional()
            .map_err(|e| self.fault(e))
    }

    /// Notes something about the sweep.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn set_meta(&self, key: &str, value: &str) -> Result<(), StoreError> {
        self.execute("INSERT OR REPLACE INTO meta VALUES (?1, ?2)", params![key, value])
    }

    /// Takes a note back.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn forget_meta(&self, key: &str) -> Result<(), StoreError> {
        self.execute("DELETE FROM meta WHERE key = ?1", [key])
    }

    fn execute(&self, sql: &str, params: impl rusqlite::Params) -> Result<(), StoreError> {
        let mut statement = self.connection.prepare_cached(sql).map_err(|e| self.fault(e))?;
        statement.execute(params).map(drop).map_err(|e| self.fault(e))
    }

    /// What is known of an evaluation: its counts, or why it failed.
    ///
    /// # Errors
    /// When SQLite fails, or bytes are not what was written.
    pub fn evaluation(&self, hash: &str) -> Result<Option<Result<Counted, String>>, StoreError> {
        self.found("SELECT counted, error FROM evaluations WHERE hash = ?1", hash)
    }

    /// Keeps an evaluation.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn put_evaluation(&self, hash: &str, counted: &Result<Counted, String>) -> Result<(), StoreError> {
        self.put("INSERT OR REPLACE INTO evaluations VALUES (?1, ?2, ?3)", hash, counted)
    }

    /// What is known of an accuracy.
    ///
    /// # Errors
    /// As [`Store::evaluation`].
    pub fn accuracy(&self, hash: &str) -> Result<Option<Result<Accuracy, String>>, StoreError> {
        self.found("SELECT accuracy, error FROM accuracies WHERE hash = ?1", hash)
    }

    /// Keeps an accuracy.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn put_accuracy(&self, hash: &str, accuracy: &Result<Accuracy, String>) -> Result<(), StoreError> {
        self.put("INSERT OR REPLACE INTO accuracies VALUES (?1, ?2, ?3)", hash, accuracy)
    }

    fn found<T: DeserializeOwned>(
        &self,
        sql: &str,
        hash: &str,
    ) -> Result<Option<Result<T, String>>, StoreError> {
        let mut statement = self.connection.prepare_cached(sql).map_err(|e| self.fault(e))?;
        let row = statement
            .query_row([hash], |row| {
                Ok((row.get::<_, Option<Vec<u8>>>(0)?, row.get::<_, Option<String>>(1)?))
            })
            .optional()
            .map_err(|e| self.fault(e))?;
        match row {
            None => Ok(None),
            Some((Some(bytes), _)) => postcard::from_bytes(&bytes)
                .map(|value| Some(Ok(value)))
                .map_err(|e| self.other(format!("evaluation {hash} cannot be read: {e}"))),
            Some((None, error)) => Ok(Some(Err(error.unwrap_or_default()))),
        }
    }

    fn put<T: Serialize>(&self, sql: &str, hash: &str, value: &Result<T, String>) -> Result<(), StoreError> {
        let (bytes, error) = match value {
            Ok(value) => (Some(crate::framed_file::encode(value)), None),
            Err(error) => (None, Some(error)),
        };
        self.execute(sql, params![hash, bytes, error])
    }

    /// Keeps points, all of them or none.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn put_points(&mut self, points: &[(StoredPoint, String, String)]) -> Result<(), StoreError> {
        let file = self.file.clone();
        let fault = |source| StoreError::Sqlite { file: file.clone(), source };
        let transaction = self.connection.transaction().map_err(fault)?;
        {
            let mut insert = transaction
                .prepare_cached("INSERT OR REPLACE INTO points VALUES (?1, ?2, ?3, ?4, ?5)")
                .map_err(fault)?;
            for (point, parameters, metrics) in points {
                let ordinal = point.ordinal as i64;
                insert
                    .execute(params![ordinal, point.status, point.error, parameters, metrics])
                    .map_err(fault)?;
            }
        }
        transaction.commit().map_err(fault)
    }

    /// All points, by ordinal.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn points(&self) -> Result<Vec<StoredPoint>, StoreError> {
        let sql = "SELECT ordinal, status, error FROM points ORDER BY ordinal";
        let mut statement = self.connection.prepare_cached(sql).map_err(|e| self.fault(e))?;
        let rows = statement.query_map([], |row| {
            let ordinal: i64 = row.get(0)?;
            Ok(StoredPoint { ordinal: ordinal as u64, status: row.get(1)?, error: row.get(2)? })
        });
        rows.and_then(Iterator::collect).map_err(|e| self.fault(e))
    }

    /// Forgets the points, not the evaluations: the sweep is another one now.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn forget_points(&self) -> Result<(), StoreError> {
        self.execute("DELETE FROM points", [])
    }

    /// Evaluations in the store.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn n_evaluations(&self) -> Result<u64, StoreError> {
        let n: i64 = self
            .connection
            .query_row("SELECT count(*) FROM evaluations", [], |row| row.get(0))
            .map_err(|e| self.fault(e))?;
        Ok(n as u64)
    }

    /// Takes over all evaluations of another store that this one has not.
    ///
    /// # Errors
    /// When SQLite fails.
    pub fn take_evaluations(&self, other: &Store) -> Result<(), StoreError> {
        for table in ["evaluations", "accuracies"] {
            let mut from =
                other.connection.prepare(&format!("SELECT * FROM {table}")).map_err(|e| other.fault(e))?;
            let mut rows = from.query([]).map_err(|e| other.fault(e))?;
            let insert = format!("INSERT OR IGNORE INTO {table} VALUES (?1, ?2, ?3)");
            self.connection.execute_batch("BEGIN").map_err(|e| self.fault(e))?;
            while let Some(row) = rows.next().map_err(|e| other.fault(e))? {
                let values: rusqlite::Result<(String, Option<Vec<u8>>, Option<String>)> =
                    (|| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))();
                let (hash, bytes, error) = values.map_err(|e| other.fault(e))?;
                self.execute(&insert, params![hash, bytes, error])?;
            }
            self.connection.execute_batch("COMMIT").map_err(|e| self.fault(e))?;
        }
        Ok(())
    }
}

/// The hash of an evaluation.
pub fn evaluation_hash(spec: &BoardSpec, settings: &[Setting], extent: Extent) -> String {
    let named = BoardSpec { name: String::new(), ..spec.clone() };
    hash_of(&(version(), "evaluation", named, settings, extent))
}

/// The hash of an accuracy; `spec` is a canonical board.
pub fn accuracy_hash(spec: &BoardSpec, settings: &[Setting], pictures: bool) -> String {
    hash_of(&(version(), "accuracy", spec, settings, pictures))
}

/// BLAKE3 of a value as JSON, which shows every field by name and floats exactly.
pub fn hash_of(value: &impl Serialize) -> String {
    // Only maps with keys that are no strings, or a failing `Serialize`, are refused: there is none.
    let text = serde_json::to_vec(value).unwrap_or_else(|e| panic!("plain data has a JSON form: {e}"));
    blake3::hash(&text).to_hex()[..32].to_owned()
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
