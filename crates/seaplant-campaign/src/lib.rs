//! seaplant-campaign
